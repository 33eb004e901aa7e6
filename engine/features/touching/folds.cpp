#include "engine/features/touching/folds.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Sides of a fold face each other by this cosine (120 degrees).
constexpr double kFoldFacing = -0.5;
/// What has gone farther through the other side than this, or than this share of the wall that the
/// patch belongs to, isn't told from a wall's far side, or from what lies around an edge. Sides are
/// met before they cross: solved contact leaves tenths of a millimetre [m].
constexpr double kDeepestFold = 1e-3, kShareOfWall = 0.35;
/// What was nearer at rest than this over a patch's radius lies beside it on the same side, or
/// around an edge. Where the two faced each other across air at rest they are sides of a fold, and
/// only its innermost corner is left out.
constexpr double kBeside = 4.0, kBesideInFold = 1.2;
constexpr double kSkin = 1e-6;  ///< a ray begins so far inside [m]
/// Of the two sides of a fold that brings its patches which lies lower along this way at rest. Any
/// way serves that folds seldom lie along; so all patches about a place are of one side.
const Vec3 kWay(0.36, 0.48, 0.80);
/// Meetings whose ends lie nearer to each other than this over a patch's radius are one.
constexpr double kSame = 1.2;

}  // namespace

FoldSides fold_sides(std::span<const SurfacePatch> patches, const CollisionSurface& finder) {
  FoldSides sides{std::vector<float>(patches.size())};
  parallel_for_each_index(patches.size(), 64, [&](std::size_t p) {
    const SurfacePatch& patch = patches[p];
    const auto hit = finder.cast(patch.position - kSkin * patch.normal, -patch.normal,
                                 kDeepestFold / kShareOfWall, true);
    sides.behind[p] = static_cast<float>(hit ? kShareOfWall * hit->distance : kDeepestFold);
  });
  return sides;
}

std::optional<CollisionSurface::Hit> nearest_fold(const DrawnOrgan& organ,
                                                  const CollisionSurface& finder,
                                                  const SurfacePatch& patch, double behind,
                                                  double farthest) {
  const Vec3 here = organ.place_in_organ(patch.point);
  const Vec3 own = organ.normal_in_organ(patch.point.triangle);
  const double radius = std::sqrt(patch.area / 3.0);
  const auto way_to = [&](const CollisionSurface::Hit& hit) {
    return Vec3(position(organ.surface, hit.point) - patch.position);
  };
  const auto lies_apart = [&](const CollisionSurface::Hit& found) {
    const Vec3 way = way_to(found);
    const bool faced = way.dot(patch.normal) > 0.0 &&
                       way.dot(area_vector(organ.surface, found.point.triangle)) < 0.0;
    return way.norm() > (faced ? kBesideInFold : kBeside) * radius;
  };
  const auto hit =
      finder.closest(here, std::max(behind, farthest), [&](const CollisionSurface::Hit& found) {
        const Vec3 other = organ.normal_in_organ(found.point.triangle), gap = found.position - here;
        return own.dot(other) < kFoldFacing && gap.dot(own) > -behind &&
               -gap.dot(other) > -behind && lies_apart(found);
      });
  if (!hit || !(way_to(*hit).dot(kWay) > 0.0)) return std::nullopt;
  return hit;
}

bool same_fold(const SurfacePatch& one, const SurfacePatch& one_on, const SurfacePatch& other,
               const SurfacePatch& other_on) {
  const double near = kSame * std::sqrt(std::min(one.area, other.area) / 3.0);
  return (one.position - other_on.position).norm() < near &&
         (other.position - one_on.position).norm() < near;
}

}  // namespace viscera
