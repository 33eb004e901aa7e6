// Organs' shapes: the contact problem's forces, what they displace, and the drawn surface.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/simulation/feature.h"

namespace viscera {

class GpuSurfaces;

/// Deforms drawn surfaces; none: the CPU does.
struct GpuOrgans {
  std::shared_ptr<GpuSurfaces> surfaces;
};

/// A jaw that slips, or a clip out of balance, is solved again with the tissue let back; this many
/// times a frame at most.
inline constexpr int kSlipPasses = 4;

/// Contact on single organs, as *deform organs* hands it to what binds them.
struct ContactSolves {
  /// Solves it on one, its last cells met by what yields as this matrix says.
  std::function<void(Entity organ, const MatrixX& backing)> alone;
  /// Of an organ whose forces were found with those of others: lets jaws slide that pull too hard,
  /// and clips go. True: one did, and all of it must be solved again.
  std::function<bool(Entity organ)> settle_held;
  /// Of such an organ, once none does: nothing that isn't finite goes on, flags are raised.
  std::function<void(Entity organ)> accept;
};

/// What ties organs together, so that their contact is solved as one: what they touch, links.
struct Binder {
  void (*solve)(World&, const ContactSolves&) = nullptr;  ///< of all bound organs
  bool (*solves)(const World&, Entity organ) = nullptr;   ///< whether that answered for this one
  /// Whether this one stays as it is in this frame; null: none does.
  bool (*rests)(const World&, Entity organ) = nullptr;
};
/// In the order in which they solve; an organ that one has answered for is none of the next one's.
struct Binding {
  std::vector<Binder> binders;
};
void bind(World& world, const Binder& binder);
/// Whether every organ that may be touched stays as it is in this frame.
bool all_stay(const World& world);

/// End of an organ's cells of tools, of their shafts and of clips, which come before those of what
/// binds it; 0: there are none.
std::size_t own_cells(const World& world, Entity organ);

/// The device has failed: from now on all organs are the CPU's, which makes what their last shapes
/// lack. Nothing to do where none is on the GPU.
void leave_gpu(World& world, const std::string& why);
/// Shapes whose displacements lie on a device count as the CPU's, without them.
void forget_device_shapes(World& world);

/// That and why an organ's elasticity isn't prepared.
SkippedReport skipped_elasticity(const OrganDescription& organ);
std::vector<std::string> deformation_warnings(const World& world);

Feature deformation_feature();

}  // namespace viscera
