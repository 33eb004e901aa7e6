// A surface's triangles in clusters of neighbours, so that what lies beside the picture needn't be
// drawn.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/points/surface.h"

namespace viscera {

class TriangleClusters {
 public:
  static constexpr std::size_t kTriangles = 512;  ///< in a cluster, at most

  TriangleClusters() = default;
  /// Orders the triangles along a space-filling curve [Morton1966] through their middles at rest.
  explicit TriangleClusters(const TriangleSurface& rest);

  /// Bounds of the clusters of the deformed surface.
  void fit(std::span<const Vec3f> positions);

  /// All of the surface's triangles, cluster by cluster.
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
  std::size_t count() const { return (triangles_.size() + kTriangles - 1) / kTriangles; }
  /// The triangles of one cluster: part of triangles().
  std::span<const std::array<int, 3>> cluster(std::size_t index) const;
  const Box& bounds(std::size_t index) const { return bounds_[index]; }

 private:
  std::vector<std::array<int, 3>> triangles_;
  std::vector<Box> bounds_;
};

}  // namespace viscera
