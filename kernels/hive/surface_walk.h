// Walking a triangle surface from where one was last: the local neighbourhood search of [De2006],
// on triangles instead of nodes, so that what it finds doesn't depend on how fine the mesh is. A
// walk only ever crosses edges, so it can't jump to the far side of a thin body.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// A place on a walkable surface.
struct SurfaceSpot {
  SurfacePoint point;
  Vec3 position = Vec3::Zero();  ///< of the vertices that were walked on [m]
  Vec3 normal = Vec3::UnitZ();   ///< outward, unit; the vertices' own, interpolated
  bool on_surface() const { return point.triangle >= 0; }
  static constexpr auto fields() {
    return std::tuple(field("point", &SurfaceSpot::point),
                      field("position", &SurfaceSpot::position),
                      field("normal", &SurfaceSpot::normal));
  }
};
static_assert(fields_cover<SurfaceSpot>());

/// What a walk ended with.
enum class WalkEnd {
  kFound,  ///< no neighbour is nearer
  kLost,   ///< too many steps, or farther away than asked for: to be found globally
  kEdge,   ///< a straight walk left an open surface
};

/// Triangles, who their neighbours are, and the rest shape. Immutable; walks allocate nothing and
/// may run in many threads at once. Walks take vertex positions, since contact is found on the
/// deformed surface, while hives are built at rest.
class WalkableSurface {
 public:
  /// Fails where three triangles meet at an edge, or two neighbours disagree on what is outside.
  static Result<WalkableSurface> make(TriangleSurface surface);

  const TriangleSurface& surface() const { return surface_; }
  const std::vector<Vec3>& normals() const { return normals_; }  ///< at rest vertices, unit
  double mean_edge() const { return mean_edge_; }                ///< [m]

  /// Moves `spot` to the nearest place to `tip` that goes downhill all the way from where it is, a
  /// triangle's neighbourhood at a time.
  /// Found: its position and normal are those of `vertices` (normals: at rest, when empty).
  /// `reach` [m]: farther from the surface it is lost. A `tip` that isn't finite is lost too; then,
  /// and whenever it is lost, `spot` stays.
  WalkEnd walk(std::span<const Vec3> vertices, std::span<const Vec3> vertex_normals,
               const Vec3& tip, double reach, SurfaceSpot& spot) const noexcept;
  /// The same on the rest shape.
  WalkEnd walk(const Vec3& tip, double reach, SurfaceSpot& spot) const noexcept {
    return walk(surface_.vertices, normals_, tip, reach, spot);
  }

  /// Straight ahead over the rest shape from `spot`, as long as `along` and towards it (its part
  /// across the normal of the triangle turned into that triangle): a geodesic.
  WalkEnd straight(const Vec3& along, SurfaceSpot& spot) const noexcept;

  /// The place of the rest surface nearest to `tip` by looking at every triangle: where a walk
  /// begins when nothing faster is at hand.
  SurfaceSpot nearest(const Vec3& tip) const noexcept;

  /// Position and normal of a point at rest.
  SurfaceSpot at(const SurfacePoint& point) const noexcept;
  /// The point is one of this surface, or none.
  bool has(const SurfacePoint& point) const noexcept {
    return point.triangle < 0 ||
           (static_cast<std::size_t>(point.triangle) < surface_.triangles.size() &&
            point.weights.allFinite());
  }

 private:
  WalkableSurface() = default;

  TriangleSurface surface_;
  std::vector<Vec3> normals_;
  std::vector<std::array<int, 3>> across_;  ///< neighbour over the edge from corner a on; -1: none
  std::vector<int> ring_begin_, ring_;      ///< triangles about each vertex
  double mean_edge_ = 0.0;
};

}  // namespace viscera
