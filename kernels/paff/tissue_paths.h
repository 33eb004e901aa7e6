// Ways from place to place that stay in a body's tissue: straight ones, and the shortest ones
// around the air of its folds, fissures and gaps.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "kernels/base/known_pairs.h"
#include "kernels/points/surface.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// A body at rest as ways see it. Immutable; from many threads at once. Its surface is closed,
/// oriented outwards, of one piece or several. Walls that touch to within a millionth of the way
/// count as tissue.
class TissuePaths {
 public:
  explicit TissuePaths(const TriangleSurface& surface);

  /// Whether the straight way between two places of the body stays in it. The end of a way may lie
  /// on the surface.
  bool straight(const Vec3& from, const Vec3& to) const;

  /// The same, but a way may also pass over a surface that is gently concave: that bends by less
  /// than 60 degrees between where the way leaves and where it comes back, so that the way along it
  /// is at most 1.16 times as long. `may_start_outside`: a way may also begin a little outside.
  bool nearly_straight(const Vec3& from, const Vec3& to, bool may_start_outside = false) const;

  /// Visits places where ways of this length from `from` come back into the body over more than a
  /// gently concave surface, until `visit` says true of one, which is the answer: corners, centres
  /// and nearest places of the triangles that they come in through. None: all that lies as near is
  /// nearly straight ahead. Cheap where it is.
  bool any_wall_beyond_air(const Vec3& from, double length,
                           const std::function<bool(const Vec3&)>& visit) const;

  /// A place that ways around air bend at, and how long the shortest way there is.
  struct Bend {
    Vec3 position;
    double length;  ///< [m]
    int number;     ///< among its TissueBends
  };

  const TriangleSurface& surface() const { return surface_; }
  const SurfaceTree& tree() const { return tree_; }
  bool in_pieces() const { return !pieces_.empty(); }
  /// Which closed piece of the body a place is of, by the wall nearest to it; 0 of a body in one.
  int piece_at(const Vec3& place) const;

 private:
  friend class TissueBends;
  using Crossings = std::vector<SurfaceTree::Crossing>;
  bool gentle(int leaving, int entering, const Vec3& p, const Vec3& q) const;

  TriangleSurface surface_;
  SurfaceTree tree_;
  std::vector<Vec3> normals_;                 ///< unit                                (triangles)
  std::vector<std::array<int, 3>> adjacent_;  ///< across each side; -1 where not one  (triangles)
  std::vector<int> pieces_;                   ///< pieces_of_vertices()                 (vertices)
};

/// Where shortest ways bend: along the edges at which the surface is concave. Bends lie a fiftieth
/// of `detail` below the surface, so that ways to them don't run along walls, and about an eighth
/// of it apart.
class TissueBends {
 public:
  /// Bends at the places that `wanted` holds for; `detail`: the local node spacing [m].
  TissueBends(const TissuePaths& paths, const std::function<bool(const Vec3&)>& wanted,
              const std::function<double(const Vec3&)>& detail);

  /// All bends that a way through tissue shorter than `longest` leads to from `from`.
  std::vector<TissuePaths::Bend> reached(const Vec3& from, double longest) const;

  std::size_t size() const { return positions_.size(); }

 private:
  const TissuePaths& paths_;
  std::vector<Vec3> positions_;
  KnownPairs sights_;  // which see each other: searches from many places ask for the same
};

}  // namespace viscera
