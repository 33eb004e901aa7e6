// Fixed-radius neighbour search over a static set of points.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// A uniform grid over points with a query radius of their own (the support radius of a node). The
/// question asked most: which nodes' fields reach x?
class InfluenceGrid {
 public:
  /// `radii[i]` > 0 [m]: point i is reported for queries nearer than radii[i].
  InfluenceGrid(std::span<const Vec3> points, std::span<const double> radii);

  /// Indices i with |x - points[i]| < radii[i], ascending. Clears `found` first.
  void reaching(const Vec3& x, std::vector<int>& found) const;

 private:
  std::vector<Vec3> points_;
  std::vector<double> radii_;
  Box box_;
  double cell_ = 1.0;
  Eigen::Vector3i size_ = Eigen::Vector3i::Ones();
  std::vector<int> begin_, items_;  // cell -> points whose ball touches the cell
};

/// The k nearest points to each point, itself excluded; row-major (N x k), nearest first, ties
/// by index; -1 where there are not that many points.
std::vector<int> nearest_neighbours(std::span<const Vec3> points, int k);

}  // namespace viscera
