// Plane meshes of nine-node quadrilaterals, for reference solutions: turned about an axis or pulled
// up into solids.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "engine/verification/nine_node.h"
#include "kernels/base/types.h"

namespace viscera {

/// Node 3 i + j of an element is at (t_i, t_j) of the square, t = -1, 0, 1; elements may be turned
/// over.
struct QuadMesh {
  std::vector<Vec2> nodes;
  std::vector<std::array<int, 9>> elements;
};

/// Puts patches together; nodes at one place (to 1e-9 of `size`) become one.
class QuadMeshBuilder {
 public:
  explicit QuadMeshBuilder(double size) : grain_(1e-9 * size) {}
  /// A patch of elements between these borders of two parameters, `place` telling where each node
  /// lies.
  void add(const std::vector<double>& first, const std::vector<double>& second,
           const std::function<Vec2(double, double)>& place);
  QuadMesh mesh() && { return std::move(mesh_); }

 private:
  int node_at(const Vec2& place);
  double grain_;
  QuadMesh mesh_;
  std::vector<std::vector<int>> buckets_;
};

/// The rectangle between the first and the last of both borders.
QuadMesh rectangle_mesh(const std::vector<double>& x, const std::vector<double>& y);
/// r (sin, cos) of polar angles from the y axis and radii; radius 0 is one node.
QuadMesh polar_mesh(const std::vector<double>& angles, const std::vector<double>& radii);

/// The half y >= 0 of a rectangle with a disc of radius 1 about the origin in it, whose rim is a
/// line of elements.
struct DiscInRectangle {
  double left = 4.0, right = 4.0;   ///< from the origin to the sides, above 1
  double across = 4.0;              ///< to the side at y > 0, above 1
  Grading grading{0.05, 1.5, 1.0};  ///< finest at the rim and at sides within 4 of it
  int around = 8;                   ///< elements along the half of the rim; a multiple of 4
};
QuadMesh disc_in_rectangle(const DiscInRectangle& options);

/// The half y >= 0 of a disc of this radius (above 1) with one of radius 1 in it.
QuadMesh disc_in_disc(double radius, const Grading& grading, int around);

}  // namespace viscera
