// Where the springs of a link end: spread over the surfaces of both organs inside its region.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/features/links/links_keys.h"
#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

struct LinkPlaces {
  struct Spring {
    std::array<Vec3, 2> positions;  ///< world, on the surfaces; at the ground that of the other [m]
    std::array<Vec3, 2> normals;    ///< unit, outward
  };
  std::vector<Spring> springs;
  std::array<double, 2> areas{};  ///< of the surfaces inside the region [m2]
};

/// The most springs that a link becomes.
inline constexpr std::size_t kMostSprings = 7;

/// `surfaces` of the scene's organs, each in its organ's frame. Each place of the first surface is
/// tied to the nearest of the second; where surfaces of both face each other in the region, only
/// those are. Fails where an organ has no surface in the region; the error names the link's key.
Result<LinkPlaces> place_springs(const SceneDescription& scene, std::size_t link,
                                 std::span<const TriangleSurface* const> surfaces);

}  // namespace viscera
