// A closed triangle surface under change: splits, collapses and flips of edges, and vertices that
// slide over a surface. Closed and manifold before and after every operation.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Moves a point to the nearest place on the surface that is being meshed, about.
using Projection = std::function<Vec3(const Vec3&)>;

class MeshEditor {
 public:
  /// `creases`: edges that turn by more than 50 degrees keep their place and are never flipped or
  /// collapsed (bodies with sharp edges). `surface` must be closed and manifold.
  MeshEditor(const TriangleSurface& surface, Projection projection, bool creases);

  int triangle_count() const { return triangle_count_; }

  using Edge = std::pair<int, int>;  ///< vertices, the lower first
  std::vector<Edge> edges() const;
  double length(const Edge& edge) const { return (at_[edge.first] - at_[edge.second]).norm(); }

  /// Two triangles more. Refused (false) on a crease, where the middle would be projected away.
  bool split(const Edge& edge);
  /// Two triangles fewer. Refused where the surface would pinch or fold, where an edge longer than
  /// `longest` or an angle below `least_angle` [rad] would appear (unless it was worse before), and
  /// at creases.
  bool collapse(const Edge& edge, double longest, double least_angle);

  enum class Goal { kValence, kDelaunay };
  /// One pass of flips over all edges; the number made.
  int flip_edges(Goal goal);
  /// Moves every vertex towards the middle of its neighbourhood along the surface, and onto it.
  /// Moves that would fold the surface aren't made.
  void relax();
  void project_all();

  /// Without the holes that edits leave.
  TriangleSurface surface() const;

 private:
  using Triangle = std::array<int, 3>;

  bool alive(int triangle) const { return triangles_[triangle][0] >= 0; }
  std::pair<int, int> wings(const Edge& edge, int& left, int& right) const;
  std::vector<int> neighbours(int vertex) const;
  bool adjacent(int a, int b) const;
  bool is_crease(const Edge& edge) const;
  bool turns(int left, int right) const;
  bool folds(int vertex, const Vec3& to, int without) const;
  Vec3 normal(const Triangle& triangle) const;
  void replace(int triangle, const Triangle& corners);
  void remove(int triangle);
  bool flip(const Edge& edge, Goal goal);

  Projection projection_;
  std::vector<Vec3> at_;
  std::vector<Triangle> triangles_;       // (-1, ., .): removed
  std::vector<std::vector<int>> around_;  // triangles around each vertex
  std::vector<char> locked_;              // vertices on creases
  int triangle_count_ = 0;
};

/// Isotropic remeshing to edges of about `edge` [m] [Botsch2004]: split, collapse,
/// flip and relax, `rounds` times, then Delaunay flips.
void remesh(MeshEditor& mesh, double edge, int rounds);

/// Relaxes and makes Delaunay flips, `rounds` times.
void settle(MeshEditor& mesh, int rounds);

/// Exactly `triangles` (even), by collapsing the shortest or splitting the longest edges, relaxed
/// in between. False where no more edges can be collapsed.
bool reach_triangle_count(MeshEditor& mesh, int triangles);

/// The least angle of a triangle [rad].
double least_angle(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace viscera
