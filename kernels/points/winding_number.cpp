#include "kernels/points/winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace viscera {
namespace {

constexpr int kLeaf = 8;      // triangles
constexpr double kFar = 2.5;  // in radii of a group
constexpr double kSphere = 4.0 * std::numbers::pi;

}  // namespace

struct WindingNumber::Data {
  struct Node {
    Vec3 centre, area;    // area-weighted centre; sum of area vectors
    double radius = 0.0;  // of a ball about the centre that holds the triangles
    int begin = 0, end = 0;
    int left = -1, right = -1;
  };
  TriangleSurface surface;
  std::vector<int> order;  // triangles by leaves
  std::vector<Node> nodes;

  Vec3 centroid(int triangle) const {
    const auto& [a, b, c] = surface.triangles[triangle];
    return (surface.vertices[a] + surface.vertices[b] + surface.vertices[c]) / 3.0;
  }

  int build(int begin, int end) {
    const int number = static_cast<int>(nodes.size());
    nodes.emplace_back();
    Node node;
    node.begin = begin, node.end = end;
    node.centre = node.area = Vec3::Zero();
    double weights = 0.0;
    Box box;
    for (int i = begin; i < end; ++i) {
      const Vec3 area = area_vector(surface, order[i]), middle = centroid(order[i]);
      const double weight = std::max(area.norm(), 1e-300);
      node.area += area;
      node.centre += weight * middle;
      weights += weight;
      box.extend(middle);
    }
    node.centre /= weights;
    for (int i = begin; i < end; ++i) {
      for (const int v : surface.triangles[order[i]]) {
        node.radius = std::max(node.radius, (surface.vertices[v] - node.centre).norm());
      }
    }
    if (end - begin > kLeaf) {
      int axis = 0;
      box.sizes().maxCoeff(&axis);
      const int middle = (begin + end) / 2;
      std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                       [&](int a, int b) {
                         const double x = centroid(a)[axis], y = centroid(b)[axis];
                         return x != y ? x < y : a < b;
                       });
      node.left = build(begin, middle);
      node.right = build(middle, end);
    }
    nodes[number] = node;
    return number;
  }

  // Solid angle of a triangle [VanOosterom1983].
  double solid_angle(int triangle, const Vec3& x) const {
    const auto& [i, j, k] = surface.triangles[triangle];
    const Vec3 a = surface.vertices[i] - x, b = surface.vertices[j] - x,
               c = surface.vertices[k] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double divisor = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    return 2.0 * std::atan2(a.dot(b.cross(c)), divisor);
  }
};

WindingNumber::WindingNumber(const TriangleSurface& surface) : data_(std::make_unique<Data>()) {
  data_->surface = surface;
  data_->order.resize(surface.triangles.size());
  std::iota(data_->order.begin(), data_->order.end(), 0);
  if (!surface.triangles.empty()) {
    data_->build(0, static_cast<int>(surface.triangles.size()));
  }
}

WindingNumber::~WindingNumber() = default;
WindingNumber::WindingNumber(WindingNumber&&) noexcept = default;
WindingNumber& WindingNumber::operator=(WindingNumber&&) noexcept = default;

double WindingNumber::operator()(const Vec3& query) const {
  if (data_->nodes.empty()) return 0.0;
  double angle = 0.0;
  std::vector<int> stack{0};
  while (!stack.empty()) {
    const Data::Node& node = data_->nodes[stack.back()];
    stack.pop_back();
    const Vec3 towards = node.centre - query;
    const double distance = towards.norm();
    if (distance > kFar * node.radius) {
      angle += node.area.dot(towards) / (distance * distance * distance);
    } else if (node.left < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        angle += data_->solid_angle(data_->order[i], query);
      }
    } else {
      stack.push_back(node.right);
      stack.push_back(node.left);
    }
  }
  return angle / kSphere;
}

}  // namespace viscera
