// Closest points and signed distances to a closed triangle surface: a bounding-volume tree for
// set-up work (node placement, wrapping). Contact inside the step uses Embree (engine/collision).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Immutable; queries from many threads at once are safe. Keeps its own copy of the triangles.
class SurfaceTree {
 public:
  explicit SurfaceTree(const TriangleSurface& surface);
  ~SurfaceTree();
  SurfaceTree(SurfaceTree&&) noexcept;
  SurfaceTree& operator=(SurfaceTree&&) noexcept;

  struct Closest {
    SurfacePoint point;
    Vec3 position;    ///< [m]
    double distance;  ///< >= 0 [m]
  };
  Closest closest(const Vec3& query) const;
  /// Negative inside [m]; the sign from angle-weighted pseudo-normals [Baerentzen2005].
  double signed_distance(const Vec3& query) const;

  /// Where a straight way meets the surface.
  struct Crossing {
    double share;  ///< of the way, 0 at its start
    int triangle;
    bool enters;  ///< from outside
  };
  /// All crossings of the way from `from` to `to`, in its order. Ends count with a millionth of the
  /// way more, edges belong to both of their triangles: no way slips through between two, and one
  /// through an edge meets both. Triangles that the way runs along are left out. Clears `found`.
  void crossings(const Vec3& from, const Vec3& to, std::vector<Crossing>& found) const;
  /// Whether one of these enters, later than at this share of the way: the same answer, sooner.
  bool enters_after(double share, const Vec3& from, const Vec3& to) const;
  /// The triangles nearer than `radius` [m], ascending. Clears `found` first.
  void within(const Vec3& centre, double radius, std::vector<int>& found) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
