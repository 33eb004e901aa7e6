#include "kernels/parting/simplify.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "kernels/base/parallel.h"

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
        changes_(surface.vertices.size(), 0),
        seen_(surface.vertices.size(), 0) {
    constexpr std::size_t kUsually = 8;
    for (std::vector<int>& around : around_) around.reserve(kUsually);
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
    for (const auto& triangle : triangles_) left_ += triangle[0] < 0 ? 0 : 1;
    queue_ = std::priority_queue<Offer>({}, all_offers());
    std::size_t fallen = 0;
    while (!queue_.empty()) {
      const Offer offer = queue_.top();
      queue_.pop();
      if (offer.changes == changes_of(offer.a, offer.b)) fallen += fall_in(offer) ? 1 : 0;
    }
    return fallen;
  }

  std::vector<Offer> all_offers() const {
    constexpr std::size_t kChunk = 1024;
    std::vector<std::vector<Offer>> parts((triangles_.size() + kChunk - 1) / kChunk);
    parallel_chunks(triangles_.size(), kChunk, [&](std::size_t first, std::size_t last) {
      std::vector<Offer>& part = parts[first / kChunk];
      for (std::size_t t = first; t < last; ++t) {
        const std::array<int, 3>& triangle = triangles_[t];
        if (triangle[0] < 0) continue;
        for (std::size_t i = 0; i < 3; ++i)
          if (triangle[i] < triangle[(i + 1) % 3])
            if (auto made = offer_of(triangle[i], triangle[(i + 1) % 3])) part.push_back(*made);
      }
    });
    std::vector<Offer> all;
    for (const std::vector<Offer>& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
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

  std::optional<Offer> offer_of(int a, int b) const {
    if (a > b) std::swap(a, b);
    if (!((at(a) - at(b)).norm() < wanted_.longest)) return std::nullopt;
    Quadric sum = quadrics_[index(a)];
    sum += quadrics_[index(b)];
    const double error = sum.at(best_place(a, b, sum) - origin_);
    if (error > wanted_.tolerance * wanted_.tolerance) return std::nullopt;
    // Of those that cost nothing the shortest first.
    constexpr double kByLength = 1e-4;
    return Offer{error + kByLength * (at(a) - at(b)).squaredNorm(), a, b, changes_of(a, b)};
  }

  /// Visits each once: number, and what it was seen by before.
  template <class Visit>
  void each_neighbour(int vertex, const Visit& visit) {
    const std::uint32_t round = ++round_;
    for (const int t : around_[index(vertex)])
      for (const int corner : triangles_[index(t)])
        if (corner != vertex)
          if (const std::uint32_t before = std::exchange(seen_[index(corner)], round);
              before != round)
            visit(corner, before);
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

  bool may_fall(const Offer& offer, const Vec3& to) {
    std::size_t all = 0, both = 0;
    each_neighbour(offer.a, [&](int, std::uint32_t) { ++all; });
    const std::uint32_t of_a = round_;
    each_neighbour(offer.b, [&](int, std::uint32_t before) {
      ++all;
      both += before == of_a ? 1 : 0;
    });
    // Fewer than four vertices would be left of a closed piece, or it would touch itself.
    if (both != 2 || all <= 6) return false;
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
    each_neighbour(offer.a, [&](int other, std::uint32_t) {
      if (auto made = offer_of(offer.a, other)) queue_.push(*made);
    });
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
  std::vector<std::uint32_t> seen_;     // in which round each vertex was a neighbour last
  std::uint32_t round_ = 0;
  std::priority_queue<Offer> queue_;
  std::size_t left_ = 0;  // triangles as a round began
};

}  // namespace

TriangleSurface simplified(const TriangleSurface& surface, const Simplification& wanted) {
  return Simplifier(surface, wanted).run();
}

}  // namespace viscera
