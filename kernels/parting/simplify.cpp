#include "kernels/parting/simplify.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

namespace viscera {
namespace {

/// Sum of squared distances from so many planes: x^T A x - 2 b x + c.
struct Quadric {
  Mat3 a = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  double c = 0.0;
  double planes = 0.0;

  void add_plane(const Vec3& normal, const Vec3& on) {
    const double height = normal.dot(on);
    a += normal * normal.transpose();
    b += height * normal;
    c += height * height;
    planes += 1.0;
  }
  void operator+=(const Quadric& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    planes += other.planes;
  }
  /// Their mean.
  double at(const Vec3& x) const {
    return std::max(0.0, (x.dot(a * x) - 2.0 * b.dot(x) + c) / planes);
  }
};

class Simplifier {
 public:
  Simplifier(const TriangleSurface& surface, const Simplification& wanted)
      : wanted_(wanted),
        at_(surface.vertices),
        triangles_(surface.triangles),
        around_(surface.vertices.size()),
        quadrics_(surface.vertices.size()),
        changes_(surface.vertices.size(), 0) {
    // Distances are from places nearby, so that their squares don't cancel.
    if (!at_.empty()) origin_ = at_.front();
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const Vec3 normal = normal_of(triangles_[t]).stableNormalized();
      for (const int corner : triangles_[t]) {
        around_[index(corner)].push_back(static_cast<int>(t));
        quadrics_[index(corner)].add_plane(normal, at(triangles_[t][0]) - origin_);
      }
    }
  }

  /// Sides that may not fall in may when what is about them has: all are asked again.
  TriangleSurface run() {
    constexpr double kFew = 0.01;  // of the triangles
    std::size_t fallen = 0;
    do {
      fallen = fall_in_all();
    } while (static_cast<double>(fallen) > kFew * static_cast<double>(left_));
    return gathered();
  }

 private:
  struct Offer {
    double cost;
    int a, b;
    std::uint64_t changes;
    bool operator<(const Offer& other) const {
      return std::tie(cost, a, b) > std::tie(other.cost, other.a, other.b);
    }
  };

  std::size_t fall_in_all() {
    left_ = 0;
    for (const auto& triangle : triangles_) {
      if (triangle[0] < 0) continue;
      ++left_;
      for (std::size_t i = 0; i < 3; ++i)
        if (triangle[i] < triangle[(i + 1) % 3]) offer(triangle[i], triangle[(i + 1) % 3]);
    }
    std::size_t fallen = 0;
    while (!queue_.empty()) {
      const Offer offer = queue_.top();
      queue_.pop();
      if (offer.changes == changes_of(offer.a, offer.b)) fallen += fall_in(offer) ? 1 : 0;
    }
    return fallen;
  }

  static std::size_t index(int number) { return static_cast<std::size_t>(number); }
  const Vec3& at(int vertex) const { return at_[index(vertex)]; }
  std::uint64_t changes_of(int a, int b) const {
    return static_cast<std::uint64_t>(changes_[index(a)]) << 32 | changes_[index(b)];
  }

  Vec3 normal_of(const std::array<int, 3>& triangle) const {
    return (at(triangle[1]) - at(triangle[0])).cross(at(triangle[2]) - at(triangle[0]));
  }

  Vec3 best_place(int a, int b, const Quadric& sum) const {
    // Where the planes leave it open, as on a flat wall, it stays in the middle.
    const Vec3 middle = 0.5 * (at(a) + at(b)) - origin_;
    const double least = 1e-3 * sum.a.trace();
    const Mat3 firm = sum.a + least * Mat3::Identity();
    return firm.inverse() * (sum.b + least * middle) + origin_;
  }

  void offer(int a, int b) {
    if (a > b) std::swap(a, b);
    if (!((at(a) - at(b)).norm() < wanted_.longest)) return;
    Quadric sum = quadrics_[index(a)];
    sum += quadrics_[index(b)];
    const double error = sum.at(best_place(a, b, sum) - origin_);
    if (error > wanted_.tolerance * wanted_.tolerance) return;
    // Of those that cost nothing the shortest first.
    constexpr double kByLength = 1e-4;
    queue_.push({error + kByLength * (at(a) - at(b)).squaredNorm(), a, b, changes_of(a, b)});
  }

  std::vector<int> neighbours(int vertex) const {
    std::vector<int> found;
    for (const int t : around_[index(vertex)])
      for (const int corner : triangles_[index(t)])
        if (corner != vertex) found.push_back(corner);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Height over longest side, of a triangle with one corner elsewhere; its normal in `normal`.
  double width(const std::array<int, 3>& triangle, int moved, const Vec3& to, Vec3& normal) const {
    std::array<Vec3, 3> x;
    for (std::size_t i = 0; i < 3; ++i) x[i] = triangle[i] == moved ? to : at(triangle[i]);
    normal = (x[1] - x[0]).cross(x[2] - x[0]);
    const double longest = std::max(
        {(x[1] - x[0]).squaredNorm(), (x[2] - x[1]).squaredNorm(), (x[0] - x[2]).squaredNorm()});
    return longest > 0.0 ? normal.norm() / longest : 0.0;
  }

  bool may_fall(const Offer& offer, const Vec3& to) const {
    const std::vector<int> of_a = neighbours(offer.a), of_b = neighbours(offer.b);
    std::vector<int> both;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                          std::back_inserter(both));
    // Fewer than four vertices would be left of a closed piece, or it would touch itself.
    if (both.size() != 2 || of_a.size() + of_b.size() <= 6) return false;
    constexpr double kNarrow = 0.02, kTurned = 0.7, kFaces = 0.2;
    // Narrow triangles face anywhere; what replaces them faces as all that is about does.
    Vec3 facing = Vec3::Zero();
    for (const int vertex : {offer.a, offer.b})
      for (const int t : around_[index(vertex)]) facing += normal_of(triangles_[index(t)]);
    facing.stableNormalize();
    for (const auto& [vertex, other] : {std::pair(offer.a, offer.b), {offer.b, offer.a}})
      for (const int t : around_[index(vertex)]) {
        const auto& triangle = triangles_[index(t)];
        if (std::find(triangle.begin(), triangle.end(), other) != triangle.end()) continue;
        Vec3 normal, before;
        const double wide = width(triangle, vertex, to, normal);
        const double was = width(triangle, vertex, at(vertex), before);
        if (wide < std::min(kNarrow, was) || !(normal.dot(facing) > kFaces * normal.norm()))
          return false;
        if (was > kFaces && !(normal.dot(before) > kTurned * normal.norm() * before.norm()))
          return false;
        for (const int corner : triangle)
          if (corner != vertex && (at(corner) - to).norm() > wanted_.longest) return false;
      }
    return true;
  }

  bool fall_in(const Offer& offer) {
    Quadric sum = quadrics_[index(offer.a)];
    sum += quadrics_[index(offer.b)];
    const Vec3 to = best_place(offer.a, offer.b, sum);
    if (!may_fall(offer, to)) return false;
    at_[index(offer.a)] = to;
    quadrics_[index(offer.a)] = sum;
    for (const int t : around_[index(offer.b)]) {
      auto& triangle = triangles_[index(t)];
      if (std::find(triangle.begin(), triangle.end(), offer.a) != triangle.end()) {
        for (const int corner : triangle)
          if (corner != offer.b) std::erase(around_[index(corner)], t);
        triangle = {-1, -1, -1};
        continue;
      }
      std::replace(triangle.begin(), triangle.end(), offer.b, offer.a);
      around_[index(offer.a)].push_back(t);
    }
    around_[index(offer.b)].clear();
    ++changes_[index(offer.b)];
    ++changes_[index(offer.a)];
    for (const int other : neighbours(offer.a)) this->offer(offer.a, other);
    return true;
  }

  TriangleSurface gathered() const {
    TriangleSurface all{at_, {}};
    for (const auto& triangle : triangles_)
      if (triangle[0] >= 0) all.triangles.push_back(triangle);
    return with_used_vertices(all);
  }

  Simplification wanted_;
  Vec3 origin_ = Vec3::Zero();
  std::vector<Vec3> at_;
  std::vector<std::array<int, 3>> triangles_;  // (-1, ., .): removed
  std::vector<std::vector<int>> around_;       // triangles around each vertex
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> changes_;  // how often each vertex has
  std::priority_queue<Offer> queue_;
  std::size_t left_ = 0;  // triangles as a round began
};

}  // namespace

TriangleSurface simplified(const TriangleSurface& surface, const Simplification& wanted) {
  return Simplifier(surface, wanted).run();
}

}  // namespace viscera
