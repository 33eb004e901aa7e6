// Distances to triangles on a grid, through OpenVDB [Museth2013].
#pragma once

#include <vector>

#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Values at the points of a regular grid, trilinear between them.
struct DistanceGrid {
  Vec3 origin = Vec3::Zero();                      ///< of point (0, 0, 0) [m]
  double voxel = 0.0;                              ///< distance of neighbouring points [m]
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< points along each axis
  std::vector<float> values;                       ///< (size), x fastest [m]

  std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * size.y() + j) * size.x() + i;
  }
  Vec3 point(int i, int j, int k) const { return origin + voxel * Vec3(i, j, k); }
  /// Beyond the grid, the value at its nearest place.
  double operator()(const Vec3& x) const;
};

/// More grid points than this are refused.
inline constexpr double kMostGridPoints = 2e8;

/// Distance to the nearest of the triangles, exact up to `band` [m] and equal to it beyond, on a
/// grid around them with a margin of `margin` [m]. The triangles may do anything.
Result<DistanceGrid> unsigned_distance(const TriangleSurface& surface, double voxel, double band,
                                       double margin);

/// Signed distance to the zero set of `field` (negative inside), exact up to `outside` and
/// `inside` [m] from it. Fails where there is no zero set.
Result<DistanceGrid> distance_to_zero_set(const DistanceGrid& field, double outside, double inside);

}  // namespace viscera
