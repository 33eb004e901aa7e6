#include "kernels/points/kd_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace viscera {

namespace {
constexpr int kLeafSize = 8;
}

KdTree::KdTree(std::span<const Vec3> points) : points_(points.begin(), points.end()) {
  indices_.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) indices_[i] = static_cast<int>(i);
  if (points.empty()) return;
  nodes_.reserve(points.size() / 2 + 1);
  build(0, static_cast<int>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) points_[i] = points[indices_[i]];
}

// While building, points_ keeps the caller's order and only indices_ is permuted.
int KdTree::build(int begin, int end) {
  const int self = static_cast<int>(nodes_.size());
  nodes_.push_back({begin, end});
  if (end - begin <= kLeafSize) return self;

  Box box;
  for (int i = begin; i < end; ++i) box.extend(points_[indices_[i]]);
  int axis = 0;
  if (box.sizes().maxCoeff(&axis) <= 0.0) return self;  // all points coincide

  const int middle = (begin + end) / 2;
  std::nth_element(indices_.begin() + begin, indices_.begin() + middle, indices_.begin() + end,
                   [&](int a, int b) {
                     const double x = points_[a][axis], y = points_[b][axis];
                     return x < y || (x == y && a < b);
                   });
  nodes_[self].axis = axis;
  nodes_[self].split = points_[indices_[middle]][axis];
  build(begin, middle);
  nodes_[self].right = build(middle, end);
  return self;
}

void KdTree::nearest(const Vec3& x, int k, int excluded, std::vector<Found>& found) const {
  found.clear();
  if (nodes_.empty() || k <= 0) return;
  Vec3 outside = Vec3::Zero();
  visit(0, x, k, excluded, outside, found);
  std::sort_heap(found.begin(), found.end());
}

// `outside` holds, per axis, how far x lies outside the node's box; `found` is a max-heap.
void KdTree::visit(int index, const Vec3& x, int k, int excluded, Vec3& outside,
                   std::vector<Found>& found) const {
  const Node& node = nodes_[index];
  if (node.axis < 0) {
    for (int i = node.begin; i < node.end; ++i) {
      if (indices_[i] == excluded) continue;
      const Found candidate{(points_[i] - x).squaredNorm(), indices_[i]};
      if (static_cast<int>(found.size()) == k) {
        if (!(candidate < found.front())) continue;
        std::pop_heap(found.begin(), found.end());
        found.back() = candidate;
      } else {
        found.push_back(candidate);
      }
      std::push_heap(found.begin(), found.end());
    }
    return;
  }
  const double beyond = x[node.axis] - node.split;
  const int near = beyond < 0.0 ? index + 1 : node.right;
  const int far = beyond < 0.0 ? node.right : index + 1;
  visit(near, x, k, excluded, outside, found);

  const double before = outside[node.axis];
  outside[node.axis] = std::abs(beyond);
  if (static_cast<int>(found.size()) < k || outside.squaredNorm() <= found.front().distance2) {
    visit(far, x, k, excluded, outside, found);
  }
  outside[node.axis] = before;
}

double KdTree::nearest_distance(const Vec3& x) const {
  double best2 = std::numeric_limits<double>::infinity();
  Vec3 outside = Vec3::Zero();
  if (!nodes_.empty()) visit_nearest(0, x, outside, best2);
  return std::sqrt(best2);
}

// As visit, without the heap.
void KdTree::visit_nearest(int index, const Vec3& x, Vec3& outside, double& best2) const {
  const Node& node = nodes_[index];
  if (node.axis < 0) {
    for (int i = node.begin; i < node.end; ++i) {
      best2 = std::min(best2, (points_[i] - x).squaredNorm());
    }
    return;
  }
  const double beyond = x[node.axis] - node.split;
  visit_nearest(beyond < 0.0 ? index + 1 : node.right, x, outside, best2);
  const double before = outside[node.axis];
  outside[node.axis] = std::abs(beyond);
  if (outside.squaredNorm() < best2) {
    visit_nearest(beyond < 0.0 ? node.right : index + 1, x, outside, best2);
  }
  outside[node.axis] = before;
}

}  // namespace viscera
