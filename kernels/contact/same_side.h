// Whether tissue joins two places of a surface directly, or air parts them.
#pragma once

#include "kernels/base/types.h"
#include "kernels/paff/tissue_paths.h"

namespace viscera {

/// Over two places with outward unit normals: whether a way as deep as `depth` [m] below the
/// surface leads from one to the other over nothing but gently concave surfaces. `paths` null: the
/// body has no folds, and every place is on one side. Places may lie a little off the surface, as
/// those of a finer picture of it do.
inline bool same_side(const TissuePaths* paths, double depth, const Vec3& first,
                      const Vec3& first_normal, const Vec3& second, const Vec3& second_normal) {
  return !paths ||
         paths->nearly_straight(first - depth * first_normal, second - depth * second_normal, true);
}

/// How deep, in the spacing of the nodes: below a mesh's own bumps, above the other side of a thin
/// part. Chosen by eye.
inline constexpr double kSideDepth = 0.05;

}  // namespace viscera
