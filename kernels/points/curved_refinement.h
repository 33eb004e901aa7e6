// Triangles divided along the cubic edges of curved PN triangles [Vlachos2001], so that a coarse
// surface has no facets. How it is divided is decided once; its shape follows the coarse surface as
// that deforms.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

class CurvedRefinement {
 public:
  /// Whether the edge between the first two places is divided, with its middle at the third [m].
  using Divides = std::function<bool(const Vec3&, const Vec3&, const Vec3&)>;

  CurvedRefinement() = default;
  /// Goes on as long as `divides` finds an edge. Edges at corners stay straight; a closed surface
  /// stays closed.
  CurvedRefinement(const TriangleSurface& coarse, const Divides& divides);

  bool divides_any() const { return !middles_.empty(); }
  /// Of the coarse vertices and, after them, the middles.
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }

  /// Appends the middles to the coarse vertices' positions [m] and unit normals. Vec3 or Vec3f.
  template <class Vector>
  void extend(std::vector<Vector>& positions, std::vector<Vector>& normals) const;

 private:
  struct Middle {
    int from, to;        // the edge
    bool smooth = true;  // curved; else straight
    int sides = 0;       // triangles at the edge
    std::array<std::array<int, 3>, 2> side{};
  };
  class Builder;

  template <class Vector>
  static void append(const Middle& middle, std::vector<Vector>& positions,
                     std::vector<Vector>& normals);

  std::vector<Middle> middles_;
  std::vector<std::array<int, 3>> triangles_;
};

}  // namespace viscera
