// Where a bed's bonds and cells lie: on both surfaces, where these are near each other.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/features/beds/beds_keys.h"
#include "engine/features/touching/meeting_samples.h"
#include "engine/simulation/components.h"
#include "kernels/base/result.h"
#include "kernels/contact/cohesive_layer.h"

namespace viscera {

/// Places of a bed on both organs, as these lie at rest, in their frames; one place of one organ to
/// one of the other.
struct BedPlaces {
  std::array<std::vector<SurfacePatch>, 2> cells;   ///< that forces act on             (cells)
  std::array<std::vector<SurfacePoint>, 2> points;  ///< of each bond's ends            (bonds)
  std::array<std::vector<Vec3>, 2> ends;            ///< the same, at rest [m]          (bonds)
  CohesiveLayer layer;
  std::size_t first = 0;  ///< of the two, along whose surface the shares are taken
  double reach = 0.0;     ///< of shares of cells in a bond's opening [m]
};

/// Cells lie as far apart as nodes of the finer organ; `first`: which of the two that is. The error
/// names the bed's key where no surfaces are so near each other.
Result<BedPlaces> place_bed(const SceneDescription& scene, std::size_t bed,
                            std::array<const OrganModel*, 2> organs, std::array<Pose, 2> poses,
                            std::size_t first);

}  // namespace viscera
