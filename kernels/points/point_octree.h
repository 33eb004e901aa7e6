// A growing set of points that answers "is any point nearer than r?", for points of any grading.
#pragma once

#include <array>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

class PointOctree {
 public:
  /// Points must lie in this box.
  explicit PointOctree(const Box& box);

  /// `point` must not coincide with more than a few points inserted before.
  void insert(const Vec3& point);
  bool any_nearer(const Vec3& x, double radius) const;

 private:
  static constexpr int kLeafSize = 8;

  struct Cell {
    Vec3 centre;
    double half = 0.0;  // half the edge [m]
    int children = -1;  // the first of eight; -1 for a leaf
    int count = 0;
    std::array<Vec3, kLeafSize> points;
  };

  static int octant(const Cell& cell, const Vec3& x);
  void split(int cell);

  std::vector<Cell> cells_;
};

}  // namespace viscera
