// The surface on which a field between the places of a lattice is zero.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <unordered_map>

#include "kernels/points/surface.h"

namespace viscera {

/// Marching tetrahedra [Doi1991], a cube of the lattice at a time: six tetrahedra a cube, about the
/// diagonal from its first corner to its last, so that neighbouring cubes divide their common side
/// alike. Where all cubes that the surface passes through were visited it is closed and manifold,
/// which marching cubes and dual methods don't promise, and goes about what is negative.
class MarchingTetrahedra {
 public:
  using Index = Eigen::Vector3i;  ///< of a place; each at most half a million from 0

  /// `place`: of the lattice [m].
  explicit MarchingTetrahedra(std::function<Vec3(const Index&)> place) : place_(std::move(place)) {}

  /// The place of a cube's corner c.
  static Index corner(const Index& first, int c) {
    return first + Index(c & 1, c >> 1 & 1, c >> 2);
  }
  /// The field at its corners. Vertices keep a twentieth of an edge from its ends, so that no
  /// triangle begins without area.
  void visit(const Index& first, const std::array<double, 8>& values);

  TriangleSurface take() { return std::move(surface_); }

 private:
  struct Corner {
    Index at;
    double value;
  };
  void tetrahedron(std::array<const Corner*, 4> c);
  void triangle(int a, int b, int c) { surface_.triangles.push_back({a, b, c}); }
  int cut(const Corner* a, const Corner* b);

  std::function<Vec3(const Index&)> place_;
  std::unordered_map<std::uint64_t, int> cuts_;  // vertices, by their edges
  TriangleSurface surface_;
};

}  // namespace viscera
