#include "engine/features/touching/folds.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Sides of a fold face each other by this cosine (120 degrees).
constexpr double kFacing = -0.5;
/// What has gone farther through the other side than this, or than this share of the wall that the
/// patch belongs to, isn't told from a wall's far side, or from what lies around an edge. Sides are
/// met before they cross: solved contact leaves tenths of a millimetre [m].
constexpr double kDeepest = 1e-3, kShareOfWall = 0.35;
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

Vec3 drawn(const FoldedSurface& surface, const SurfacePoint& point) {
  Vec3 sum = Vec3::Zero();
  const auto& corners = surface.rest.triangles[static_cast<std::size_t>(point.triangle)];
  for (std::size_t c = 0; c < 3; ++c)
    sum += point.weights[static_cast<Eigen::Index>(c)] *
           surface.positions[static_cast<std::size_t>(corners[c])].cast<double>();
  return sum;
}

/// Of the drawn triangle, outward; not unit.
Vec3 across(const FoldedSurface& surface, int triangle) {
  const auto& corners = surface.rest.triangles[static_cast<std::size_t>(triangle)];
  const auto at = [&](std::size_t c) {
    return surface.positions[static_cast<std::size_t>(corners[c])].cast<double>();
  };
  return (at(1) - at(0)).cross(at(2) - at(0));
}

}  // namespace

FoldSides fold_sides(std::span<const SurfacePatch> patches, const CollisionSurface& finder) {
  FoldSides sides{std::vector<float>(patches.size())};
  parallel_for_each_index(patches.size(), 64, [&](std::size_t p) {
    const SurfacePatch& patch = patches[p];
    const auto hit = finder.cast(patch.position - kSkin * patch.normal, -patch.normal,
                                 kDeepest / kShareOfWall, true);
    sides.behind[p] = static_cast<float>(hit ? kShareOfWall * hit->distance : kDeepest);
  });
  return sides;
}

std::optional<CollisionSurface::Hit> nearest_fold(const FoldedSurface& surface,
                                                  const SurfacePatch& patch, double behind,
                                                  double farthest) {
  const Vec3 here = drawn(surface, patch.point);
  const Vec3 own = across(surface, patch.point.triangle).stableNormalized();
  const double radius = std::sqrt(patch.area / 3.0);
  const auto way_to = [&](const CollisionSurface::Hit& hit) {
    return Vec3(position(surface.rest, hit.point) - patch.position);
  };
  const auto lies_apart = [&](const CollisionSurface::Hit& found) {
    const Vec3 way = way_to(found);
    const bool faced = way.dot(patch.normal) > 0.0 &&
                       way.dot(area_vector(surface.rest, found.point.triangle)) < 0.0;
    return way.norm() > (faced ? kBesideInFold : kBeside) * radius;
  };
  const auto hit = surface.finder.closest(
      here, std::max(behind, farthest), [&](const CollisionSurface::Hit& found) {
        const Vec3 other = across(surface, found.point.triangle), gap = found.position - here;
        const double size = other.norm();
        return own.dot(other) < kFacing * size && gap.dot(own) > -behind &&
               -gap.dot(other) > -behind * size && lies_apart(found);
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
