// A k-d tree over a static set of points: nearest points whatever their grading.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Immutable; queries from many threads at once are safe. Ties in distance go to the lower index.
class KdTree {
 public:
  explicit KdTree(std::span<const Vec3> points);

  struct Found {
    double distance2;  ///< squared distance [m2]
    int index;         ///< index of the point in the span given to the constructor

    bool operator<(const Found& other) const {
      return distance2 < other.distance2 || (distance2 == other.distance2 && index < other.index);
    }
  };

  /// The k points nearest to x, nearest first; `excluded` (an index, or -1) is left out. Fewer than
  /// k where there are fewer. Clears `found` first.
  void nearest(const Vec3& x, int k, int excluded, std::vector<Found>& found) const;

  /// Distance to the nearest point [m]; infinite where there is none.
  double nearest_distance(const Vec3& x) const;

 private:
  /// A leaf holds points_[begin, end); an inner node has its left child right behind it.
  struct Node {
    int begin, end;
    int axis = -1;  ///< -1 for a leaf
    int right = -1;
    double split = 0.0;
  };

  int build(int begin, int end);
  void visit(int node, const Vec3& x, int k, int excluded, Vec3& outside,
             std::vector<Found>& found) const;
  void visit_nearest(int node, const Vec3& x, Vec3& outside, double& best2) const;

  std::vector<Node> nodes_;
  std::vector<Vec3> points_;  // in the order of the leaves
  std::vector<int> indices_;  // their indices in the order of the caller
};

}  // namespace viscera
