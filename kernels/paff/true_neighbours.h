// Fields that don't cross what isn't tissue. A node's field reaches a sphere about it; where the
// straight line from node I to a place y leaves the body, over a fold, a fissure or the gap between
// two parts, the field there is shared between the node and a twin of its own at the same place:
//   s phi_I for the node, (1 - s) phi_I for the twin,
//   s = W(shortest way through tissue / r_I) / W(straight way / r_I).
// The moment matrices don't change, so that a part with too few nodes of its own is carried by the
// twins of the others, and s falls from 1 to 0 continuously around the end of a fold. A node whose
// twin would be slight (a hundredth of its integral) has none: there it weighs W of the way through
// tissue. One twin a part of the deep shadow {s < 1/2}.
//
// Of a body in several pieces, as one that is severed, a node has nothing of another piece but by a
// twin that is that piece's own: which piece a place is of, the wall nearest to it says, exactly,
// where ways past walls are known to their dents alone.
//
// A node may lie in air itself, where tissue was taken away about it: it stays to carry what is
// left, and its ways begin at the nearest wall.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/paff/cut_cells.h"
#include "kernels/paff/local_spacing.h"
#include "kernels/paff/tissue_paths.h"
#include "kernels/points/cloud.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Which nodes of a body at rest don't see all of their support, and what they see instead.
/// Immutable; from many threads at once.
class TrueNeighbours {
 public:
  /// Null where every field sees all that it reaches but for gently concave surfaces: nothing is to
  /// be done then. Parallel, deterministic.
  static std::shared_ptr<const TrueNeighbours> find(const TriangleSurface& surface,
                                                    const PointCloud& cloud, double support_factor);

  /// The nodes, then their twins, each at its node's place with its node's spacing.
  const PointCloud& cloud() const { return cloud_; }
  std::size_t twins() const { return parents_.size(); }
  /// Node of the twin i.
  int parent(std::size_t twin) const { return parents_[twin]; }
  /// The place nearest to its node in the deep shadow that the twin i carries.
  const Vec3& place_of_twin(std::size_t twin) const { return places_[twin]; }

  const TissuePaths& paths() const { return paths_; }

  /// What a place has of a node's field.
  struct Shadow {
    double way = 0.0;              ///< through tissue, at most the support radius [m]
    Vec3 gradient = Vec3::Zero();  ///< of it by the place
    int twin = -1;                 ///< node of the cloud that has the rest; -1: none
  };
  /// A place in the body, and which bends and points about it see it: many nodes ask for the same.
  /// To be kept for place after place, by one thread.
  class View {
   public:
    /// Looks from this place from now on; what was known is forgotten.
    void take(const TrueNeighbours& body, const Vec3& place);
    const Vec3& place() const { return place_; }
    int piece() const { return piece_; }
    /// Whether a straight way joins it with the bend, or the point of the volume, that has this
    /// number and lies there.
    bool sees_bend(int bend, const Vec3& position) { return found(bends_, bend, position, true); }
    bool sees_point(int point, const Vec3& position) {
      return found(points_, point, position, false);
    }

   private:
    using Answers = std::vector<std::uint32_t>;  // twice the look that they are of, and the answer
    bool found(Answers& known, int number, const Vec3& position, bool from_there);

    const TissuePaths* paths_ = nullptr;
    Vec3 place_ = Vec3::Zero();
    int piece_ = 0;
    std::uint32_t look_ = 0;
    Answers bends_, points_;
  };
  /// False where the node (one of the first ones, without the twins) sees the place.
  bool shadow(int node, View& view, Shadow& out) const;

 private:
  /// A node with shadows.
  struct Blocked {
    Vec3 from;  ///< where its ways begin: the node, or a wall near one in air
    std::vector<TissuePaths::Bend> bends;
    std::vector<Vec3> places;  ///< that lie in its deep shadow
    std::vector<int> points;   ///< of each its number, the same for all nodes
    std::vector<int> twins;    ///< of each: node of the cloud, or -1
    std::vector<int> pieces;   ///< of each; empty: the body is in one
    bool divided = false;      ///< the places have different ones
    int piece = 0;             ///< of the node
  };
  /// A point of the volume in a node's reach: its number and what it has of the node.
  struct PointInReach {
    std::size_t point;
    double full, kept;  ///< weight without walls; what they leave
    int piece;
  };

  TrueNeighbours(const TriangleSurface& surface, const PointCloud& cloud, double support_factor)
      : cloud_(cloud), support_factor_(support_factor), paths_(surface) {}
  bool reaches_other_piece(std::size_t node, const Vec3& from) const;
  bool find_blocked();
  std::vector<Blocked> ways_around(const std::vector<std::size_t>& nodes,
                                   const std::vector<Vec3>& beginnings,
                                   const LocalSpacing& spacing) const;
  void find_shadows(const std::vector<std::size_t>& nodes, const std::vector<char>& keeps,
                    const VolumeQuadrature& volume, std::vector<Blocked>& blocked) const;
  void find_parts(std::size_t node, const VolumeQuadrature& volume,
                  const std::vector<PointInReach>& points, Blocked& blocked) const;
  double radius(std::size_t node) const { return support_factor_ * cloud_.spacings[node]; }
  Vec3 beginning(std::size_t node) const;
  Vec3 nearest_place(const Blocked& blocked, int twin, std::size_t node) const;
  bool way_through(const Blocked& blocked, const Vec3& node, double longest, View& view,
                   Shadow& out) const;

  PointCloud cloud_;
  double support_factor_ = 0.0;
  TissuePaths paths_;
  std::vector<SurfaceTree> walls_of_pieces_;  ///< empty: the body is in one
  std::vector<int> parents_;
  std::vector<Vec3> places_;     ///< of the twins: place_of_twin
  std::vector<int> blocked_of_;  ///< -1: sees all                                      (nodes)
  std::vector<Blocked> blocked_;
};

}  // namespace viscera
