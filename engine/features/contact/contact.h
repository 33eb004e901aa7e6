// Contact of tools with organs: whose tissue lies under which tip.
#pragma once

#include <functional>

#include "engine/features/contact/contact_flags.h"
#include "engine/simulation/feature.h"
#include "kernels/points/surface_scan.h"

namespace viscera {

/// Of an organ that may be touched: for places on it that are asked for once a step.
struct ScannedSurface {
  static constexpr bool kConstant = true;
  SurfaceScan scan;
};
/// Of one that is another body than the model's.
struct RescannedSurface {
  SurfaceScan scan;
};

/// Of an organ at rest, its frame here; world [m].
Box bounds_at_rest(const OrganModel& model, const Pose& pose);

/// How deformation has moved a cell of an organ's last solve, world [m].
Vec3 cell_displacement(const World& world, Entity organ, std::size_t cell);

/// An instrument that holds something keeps the cells for which `keeps(number in its grasp)`, of
/// two jaws those whose opposite ones it keeps, too. It lets go where none are left.
void keep_held(World& world, Entity instrument, const std::function<bool(std::size_t)>& keeps);

/// InstrumentState, deformed surfaces -> OrganContact.cells, OrganTouch.ranges,
/// InstrumentContact.grasp.
void find_contacts(World& world, const FrameContext& context);
/// Contact sees the tissue where gravity and the like have moved it: ContactCell.free.
void let_cells_move(World& world);

Feature contact_feature();

}  // namespace viscera
