#include "kernels/points/surface_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "kernels/points/box_fours.h"

namespace viscera {

namespace {

constexpr int kLeafSize = 4;
constexpr int kStackSize = 64;  // median splits: the depth is the logarithm of the triangles

/// Which part of a triangle is nearest.
enum class Feature { kFace, kVertex0, kVertex1, kVertex2, kEdge01, kEdge12, kEdge20 };

struct NearestOnTriangle {
  Vec3 weights;
  Feature feature;
};

NearestOnTriangle nearest_on_edge(const Vec3& x, const std::array<Vec3, 3>& p, int i) {
  const int j = (i + 1) % 3;
  const Vec3 edge = p[j] - p[i];
  const double length2 = edge.squaredNorm();
  const double share = length2 > 0.0 ? std::clamp(edge.dot(x - p[i]) / length2, 0.0, 1.0) : 0.0;
  NearestOnTriangle nearest{Vec3::Zero(), Feature(static_cast<int>(Feature::kEdge01) + i)};
  nearest.weights[i] = 1.0 - share;
  nearest.weights[j] = share;
  if (share == 0.0) nearest.feature = Feature(static_cast<int>(Feature::kVertex0) + i);
  if (share == 1.0) nearest.feature = Feature(static_cast<int>(Feature::kVertex0) + j);
  return nearest;
}

/// The nearest place of a triangle and the Voronoi region that x lies in [Ericson2005] 5.1.5.
NearestOnTriangle nearest_on_triangle(const Vec3& x, const std::array<Vec3, 3>& p) {
  const Vec3 ab = p[1] - p[0], ac = p[2] - p[0];
  const Vec3 ax = x - p[0];
  const double d1 = ab.dot(ax), d2 = ac.dot(ax);
  if (d1 <= 0.0 && d2 <= 0.0) return {Vec3::UnitX(), Feature::kVertex0};
  const Vec3 bx = x - p[1];
  const double d3 = ab.dot(bx), d4 = ac.dot(bx);
  if (d3 >= 0.0 && d4 <= d3) return {Vec3::UnitY(), Feature::kVertex1};
  const Vec3 cx = x - p[2];
  const double d5 = ab.dot(cx), d6 = ac.dot(cx);
  if (d6 >= 0.0 && d5 <= d6) return {Vec3::UnitZ(), Feature::kVertex2};

  const double wc = d1 * d4 - d3 * d2;
  if (wc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return nearest_on_edge(x, p, 0);
  const double wa = d3 * d6 - d5 * d4;
  if (wa <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) return nearest_on_edge(x, p, 1);
  const double wb = d5 * d2 - d1 * d6;
  if (wb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return nearest_on_edge(x, p, 2);

  const double sum = wa + wb + wc;
  if (!(sum > 0.0)) return nearest_on_edge(x, p, 0);  // a needle, by rounding
  return {Vec3(wa, wb, wc) / sum, Feature::kFace};
}

}  // namespace

struct SurfaceTree::Data {
  struct Node {
    Box box;
    int begin = 0, end = 0;  // triangles of a leaf; the left child stands right behind its parent
    int right = -1;          // -1 for a leaf
  };
  /// Outward directions of the features of one triangle, in the order of Feature.
  using Normals = std::array<Vec3, 7>;

  std::vector<Node> nodes;
  std::vector<std::array<Vec3, 3>> corners;  // in the order of the leaves
  std::vector<int> triangles;                // their indices in the caller's surface
  std::vector<Normals> normals;              // in the order of the leaves
  BoxFours fours;                            // of the nodes, for ways

  struct Hit {
    int place = -1;  // into corners
    NearestOnTriangle nearest;
    Vec3 position = Vec3::Zero();
    double distance2 = std::numeric_limits<double>::infinity();
  };

  int build(const std::vector<Box>& boxes, const std::vector<Vec3>& centres, int begin, int end);
  void find_normals(const TriangleSurface& surface);
  Hit nearest(const Vec3& x) const;

  /// Calls visit(place) for the triangles of all leaves whose boxes, and those about them, are
  /// wanted.
  template <class Wanted, class Visit>
  void each_place(const Wanted& wanted, const Visit& visit) const {
    std::array<int, kStackSize> stack;
    int depth = 0;
    if (!nodes.empty()) stack[depth++] = 0;
    while (depth > 0) {
      const int at = stack[--depth];
      const Node& node = nodes[at];
      if (!wanted(node.box)) continue;
      if (node.right >= 0) {
        stack[depth++] = node.right;
        stack[depth++] = at + 1;
        continue;
      }
      for (int place = node.begin; place < node.end; ++place) visit(place);
    }
  }
  /// Calls visit(place) for the triangles that a way may meet until it says true for one, which is
  /// the answer.
  template <class Visit>
  bool any_on_way(const BoxFours::Way& way, const Visit& visit) const {
    return fours.any_leaf(way, [&](int leaf) {
      for (int place = nodes[leaf].begin; place < nodes[leaf].end; ++place)
        if (visit(place)) return true;
      return false;
    });
  }
  BoxFours with_four_children() const;
};

int SurfaceTree::Data::build(const std::vector<Box>& boxes, const std::vector<Vec3>& centres,
                             int begin, int end) {
  const int self = static_cast<int>(nodes.size());
  nodes.push_back({});
  Box spread;
  for (int i = begin; i < end; ++i) {
    nodes[self].box.extend(boxes[triangles[i]]);
    spread.extend(centres[triangles[i]]);
  }
  if (end - begin <= kLeafSize) {
    nodes[self].begin = begin;
    nodes[self].end = end;
    return self;
  }
  int axis = 0;
  spread.sizes().maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::nth_element(triangles.begin() + begin, triangles.begin() + middle, triangles.begin() + end,
                   [&](int a, int b) {
                     const double x = centres[a][axis], y = centres[b][axis];
                     return x < y || (x == y && a < b);
                   });
  build(boxes, centres, begin, middle);
  nodes[self].right = build(boxes, centres, middle, end);
  return self;
}

BoxFours SurfaceTree::Data::with_four_children() const {
  std::vector<BoxFours::Two> twos(nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    twos[k].box = nodes[k].box;
    if (nodes[k].right < 0) continue;
    twos[k].left = static_cast<int>(k) + 1;
    twos[k].right = nodes[k].right;
  }
  return BoxFours(twos);
}

// Normals of faces, of edges (sum of the two faces') and of vertices (weighted by angle): with
// these the sign of the distance is right wherever the nearest place lies [Baerentzen2005].
void SurfaceTree::Data::find_normals(const TriangleSurface& surface) {
  const std::vector<Vec3> at_vertex = vertex_normals(surface);
  const int count = static_cast<int>(surface.triangles.size());
  std::vector<Vec3> faces(count);
  struct Side {
    int low, high, triangle, side;
  };
  std::vector<Side> sides;
  sides.reserve(3 * surface.triangles.size());
  for (int t = 0; t < count; ++t) {
    faces[t] = area_vector(surface, t).normalized();
    for (int i = 0; i < 3; ++i) {
      const int a = surface.triangles[t][i], b = surface.triangles[t][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), t, i});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::array{a.low, a.high, a.triangle, a.side} <
           std::array{b.low, b.high, b.triangle, b.side};
  });
  std::vector<std::array<Vec3, 3>> at_edge(count);
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    Vec3 sum = Vec3::Zero();
    for (end = begin; end < sides.size() && sides[end].low == sides[begin].low &&
                      sides[end].high == sides[begin].high;
         ++end) {
      sum += faces[sides[end].triangle];
    }
    for (std::size_t i = begin; i < end; ++i) at_edge[sides[i].triangle][sides[i].side] = sum;
  }
  normals.resize(count);
  for (int place = 0; place < count; ++place) {
    const int t = triangles[place];
    const auto& [a, b, c] = surface.triangles[t];
    normals[place] = {faces[t],      at_vertex[a],  at_vertex[b], at_vertex[c],
                      at_edge[t][0], at_edge[t][1], at_edge[t][2]};
  }
}

SurfaceTree::Data::Hit SurfaceTree::Data::nearest(const Vec3& x) const {
  struct Pending {
    int node;
    double distance2;
  };
  std::array<Pending, kStackSize> stack;
  int depth = 0;
  Hit best;
  if (!nodes.empty()) stack[depth++] = {0, nodes[0].box.squaredExteriorDistance(x)};
  while (depth > 0) {
    const Pending next = stack[--depth];
    if (next.distance2 >= best.distance2) continue;
    const Node& node = nodes[next.node];
    if (node.right < 0) {
      for (int place = node.begin; place < node.end; ++place) {
        const std::array<Vec3, 3>& p = corners[place];
        const NearestOnTriangle nearest = nearest_on_triangle(x, p);
        const Vec3& w = nearest.weights;
        const Vec3 position = w[0] * p[0] + w[1] * p[1] + w[2] * p[2];
        const double distance2 = (x - position).squaredNorm();
        if (distance2 < best.distance2) best = {place, nearest, position, distance2};
      }
      continue;
    }
    const Pending left{next.node + 1, nodes[next.node + 1].box.squaredExteriorDistance(x)};
    const Pending right{node.right, nodes[node.right].box.squaredExteriorDistance(x)};
    const bool left_first = left.distance2 <= right.distance2;
    const Pending& far = left_first ? right : left;
    if (far.distance2 < best.distance2) stack[depth++] = far;
    stack[depth++] = left_first ? left : right;
  }
  return best;
}

SurfaceTree::SurfaceTree(const TriangleSurface& surface) : data_(std::make_unique<Data>()) {
  const int count = static_cast<int>(surface.triangles.size());
  if (count == 0) return;
  std::vector<Box> boxes(count);
  std::vector<Vec3> centres(count);
  for (int t = 0; t < count; ++t) {
    for (const int vertex : surface.triangles[t]) boxes[t].extend(surface.vertices[vertex]);
    centres[t] = boxes[t].center();
  }
  data_->triangles.resize(count);
  std::iota(data_->triangles.begin(), data_->triangles.end(), 0);
  data_->nodes.reserve(count);
  data_->build(boxes, centres, 0, count);
  data_->fours = data_->with_four_children();
  data_->corners.resize(count);
  for (int place = 0; place < count; ++place) {
    const auto& [a, b, c] = surface.triangles[data_->triangles[place]];
    data_->corners[place] = {surface.vertices[a], surface.vertices[b], surface.vertices[c]};
  }
  data_->find_normals(surface);
}

SurfaceTree::~SurfaceTree() = default;
SurfaceTree::SurfaceTree(SurfaceTree&&) noexcept = default;
SurfaceTree& SurfaceTree::operator=(SurfaceTree&&) noexcept = default;

SurfaceTree::Closest SurfaceTree::closest(const Vec3& query) const {
  const Data::Hit hit = data_->nearest(query);
  if (hit.place < 0) return {{}, query, std::numeric_limits<double>::infinity()};
  return {
      {data_->triangles[hit.place], hit.nearest.weights}, hit.position, std::sqrt(hit.distance2)};
}

double SurfaceTree::signed_distance(const Vec3& query) const {
  const Data::Hit hit = data_->nearest(query);
  if (hit.place < 0) return std::numeric_limits<double>::infinity();
  const Vec3& outward = data_->normals[hit.place][static_cast<int>(hit.nearest.feature)];
  const double distance = std::sqrt(hit.distance2);
  return outward.dot(query - hit.position) < 0.0 ? -distance : distance;
}

namespace {

/// How far beyond its ends a way, and beyond its edges a triangle, still counts, over their sizes.
constexpr double kCrossingSlack = 1e-6;

/// A straight way, for triangles that it may meet.
class Way {
 public:
  Way(const Vec3& from, const Vec3& to) : from_(from), way_(to - from), length_(way_.norm()) {}

  /// For boxes, with the slack of it and of what is `across` [m].
  BoxFours::Way for_boxes(double across) const {
    return {from_, from_ + way_, kCrossingSlack * (length_ + across)};
  }

  struct Meeting {
    double share;
    bool enters;
  };
  /// Where it meets a triangle [Moeller1997]; `only_entering`: from outside alone.
  std::optional<Meeting> meet(const std::array<Vec3, 3>& p, bool only_entering) const {
    const Vec3 ab = p[1] - p[0], ac = p[2] - p[0], across = way_.cross(ac);
    const double determinant = ab.dot(across);  // > 0: against the outward normal
    if (only_entering && !(determinant > 0.0)) return std::nullopt;
    const Vec3 offset = from_ - p[0], other = offset.cross(ab);
    const double u = offset.dot(across) / determinant, v = way_.dot(other) / determinant;
    if (!(u >= -kCrossingSlack && v >= -kCrossingSlack && u + v <= 1.0 + kCrossingSlack))
      return std::nullopt;
    const double share = ac.dot(other) / determinant;
    if (!(share >= -kCrossingSlack && share <= 1.0 + kCrossingSlack)) return std::nullopt;
    // It runs along the triangle, or the triangle is a needle.
    if (!(std::abs(determinant) > 1e-9 * ab.norm() * ac.norm() * length_)) return std::nullopt;
    return Meeting{share, determinant > 0.0};
  }

 private:
  Vec3 from_, way_;
  double length_;
};

}  // namespace

void SurfaceTree::crossings(const Vec3& from, const Vec3& to, std::vector<Crossing>& found) const {
  found.clear();
  if (data_->nodes.empty()) return;
  const Way way(from, to);
  data_->any_on_way(way.for_boxes(data_->nodes[0].box.diagonal().norm()), [&](int place) {
    if (const auto meeting = way.meet(data_->corners[place], false))
      found.push_back({meeting->share, data_->triangles[place], meeting->enters});
    return false;
  });
  std::sort(found.begin(), found.end(), [](const Crossing& a, const Crossing& b) {
    return a.share < b.share || (a.share == b.share && a.triangle < b.triangle);
  });
}

bool SurfaceTree::enters_after(double share, const Vec3& from, const Vec3& to) const {
  if (data_->nodes.empty()) return false;
  const Way way(from, to);
  const auto is_met = [&](int place) {
    const auto meeting = way.meet(data_->corners[place], true);
    return meeting && meeting->share > share;
  };
  // What stood in the last way often stands in the next.
  thread_local int last = 0;
  if (last < static_cast<int>(data_->corners.size()) && is_met(last)) return true;
  return data_->any_on_way(way.for_boxes(data_->nodes[0].box.diagonal().norm()), [&](int place) {
    if (!is_met(place)) return false;
    last = place;
    return true;
  });
}

void SurfaceTree::within(const Vec3& centre, double radius, std::vector<int>& found) const {
  found.clear();
  const double radius2 = radius * radius;
  data_->each_place(
      [&](const Box& box) { return box.squaredExteriorDistance(centre) < radius2; },
      [&](int place) {
        const std::array<Vec3, 3>& p = data_->corners[place];
        const Vec3 w = nearest_on_triangle(centre, p).weights;
        if ((centre - w[0] * p[0] - w[1] * p[1] - w[2] * p[2]).squaredNorm() < radius2)
          found.push_back(data_->triangles[place]);
      });
  std::sort(found.begin(), found.end());
}

}  // namespace viscera
