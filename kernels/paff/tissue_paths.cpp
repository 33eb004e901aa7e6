#include "kernels/paff/tissue_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "kernels/points/closed_pieces.h"
#include "kernels/points/closest_on_triangle.h"

namespace viscera {
namespace {

/// Ways that begin on a surface leave it or enter it at once; that is no crossing.
constexpr double kAtStart = 1e-6;

/// Half of the 60 degrees by which a gently concave surface may bend.
const double kGentle = std::cos(std::numbers::pi / 6.0);

struct Side {
  int low, high, triangle, side;
};

std::vector<Side> sorted_sides(const TriangleSurface& surface) {
  std::vector<Side> sides;
  sides.reserve(3 * surface.triangles.size());
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const auto& corners = surface.triangles[static_cast<std::size_t>(t)];
    for (int i = 0; i < 3; ++i) {
      const int a = corners[static_cast<std::size_t>(i)];
      const int b = corners[static_cast<std::size_t>((i + 1) % 3)];
      sides.push_back({std::min(a, b), std::max(a, b), t, i});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::array{a.low, a.high, a.triangle, a.side} <
           std::array{b.low, b.high, b.triangle, b.side};
  });
  return sides;
}

}  // namespace

TissuePaths::TissuePaths(const TriangleSurface& surface)
    : surface_(surface),
      tree_(surface),
      adjacent_(surface.triangles.size(), std::array<int, 3>{-1, -1, -1}),
      pieces_(pieces_of_vertices(surface, closed_pieces(surface))) {
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t)
    normals_.push_back(area_vector(surface, t).stableNormalized());
  const std::vector<Side> sides = sorted_sides(surface);
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].low == sides[begin].low &&
           sides[end].high == sides[begin].high)
      ++end;
    if (end - begin != 2) continue;
    const Side &a = sides[begin], &b = sides[begin + 1];
    adjacent_[static_cast<std::size_t>(a.triangle)][static_cast<std::size_t>(a.side)] = b.triangle;
    adjacent_[static_cast<std::size_t>(b.triangle)][static_cast<std::size_t>(b.side)] = a.triangle;
  }
}

int TissuePaths::piece_at(const Vec3& place) const {
  if (pieces_.empty()) return 0;
  return piece_of(pieces_, surface_, tree_.closest(place).point.triangle);
}

bool TissuePaths::straight(const Vec3& from, const Vec3& to) const {
  return !tree_.enters_after(kAtStart, from, to);
}

bool TissuePaths::nearly_straight(const Vec3& from, const Vec3& to, bool may_start_outside) const {
  if (straight(from, to)) return true;
  thread_local Crossings found;
  tree_.crossings(from, to, found);
  const SurfaceTree::Crossing* left = nullptr;
  for (const SurfaceTree::Crossing& one : found) {
    if (!one.enters) {
      left = &one;
      continue;
    }
    if (one.share <= kAtStart || (may_start_outside && !left)) continue;
    if (!left || !gentle(left->triangle, one.triangle, from + left->share * (to - from),
                         from + one.share * (to - from)))
      return false;
  }
  return true;
}

/// Whether triangles that face about the same way join the two, all of them near the line p q:
/// within the ellipsoid of ways 1.2 times as long.
bool TissuePaths::gentle(int leaving, int entering, const Vec3& p, const Vec3& q) const {
  constexpr double kWidth = 1.2;
  const auto normal = [&](int t) -> const Vec3& { return normals_[static_cast<std::size_t>(t)]; };
  const Vec3 sum = normal(leaving) + normal(entering);
  const double length = sum.norm();
  if (!(length > 2.0 * kGentle)) return false;  // more than 60 degrees apart
  const Vec3 axis = sum / length;
  const double apart = (q - p).norm();
  const auto near = [&](int t) {
    if (normal(t).dot(axis) < kGentle) return false;
    const auto& [a, b, c] = surface_.triangles[static_cast<std::size_t>(t)];
    const auto corner = [&](int v) -> const Vec3& {
      return surface_.vertices[static_cast<std::size_t>(v)];
    };
    for (const Vec3& x : {p, q, Vec3(0.5 * (p + q))}) {
      const Vec3 w = closest_weights(x, corner(a), corner(b), corner(c));
      const Vec3 at = w[0] * corner(a) + w[1] * corner(b) + w[2] * corner(c);
      if ((at - p).norm() + (at - q).norm() < kWidth * apart) return true;
    }
    return false;
  };
  std::vector<int> seen{leaving};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] == entering) return true;
    for (const int next : adjacent_[static_cast<std::size_t>(seen[i])]) {
      if (next < 0 || std::find(seen.begin(), seen.end(), next) != seen.end()) continue;
      if (next == entering) return true;
      if (near(next)) seen.push_back(next);
    }
  }
  return false;
}

bool TissuePaths::any_wall_beyond_air(const Vec3& from, double length,
                                      const std::function<bool(const Vec3&)>& visit) const {
  thread_local std::vector<int> near, facing;
  tree_.within(from, length, near);
  const auto normal = [&](int t) -> const Vec3& { return normals_[static_cast<std::size_t>(t)]; };
  const auto corner = [&](int t, std::size_t i) -> const Vec3& {
    return surface_
        .vertices[static_cast<std::size_t>(surface_.triangles[static_cast<std::size_t>(t)][i])];
  };
  // A way comes back through a triangle that turns its outer side to where the way begins ...
  const double slack = 1e-6 * length;
  facing.clear();
  for (const int t : near)
    if (normal(t).dot(from - corner(t, 0)) > slack) facing.push_back(t);
  // ... and has left through one that lies before it, and has it before itself. Over a gently
  // concave surface these face about the same way.
  constexpr double kApart = 0.5;  // cosine of 60 degrees
  const auto is_before = [&](int one, int other) {
    const double height = normal(other).dot(corner(other, 0)) + slack;
    for (std::size_t i = 0; i < 3; ++i)
      if (normal(other).dot(corner(one, i)) > height) return true;
    return false;
  };
  for (const int t : facing) {
    if (std::none_of(near.begin(), near.end(), [&](int other) {
          return normal(t).dot(normal(other)) < kApart && is_before(other, t) &&
                 is_before(t, other);
        }))
      continue;
    const Vec3 &a = corner(t, 0), &b = corner(t, 1), &c = corner(t, 2);
    const Vec3 w = closest_weights(from, a, b, c);
    // Off its edges, which belong to the next triangle as well.
    constexpr double kOff = 0.05, kFarthestOff = 0.02;  // of the triangle, of the way
    const Vec3 centre = (a + b + c) / 3.0;
    for (const Vec3& on : {Vec3(w[0] * a + w[1] * b + w[2] * c), centre, a, b, c}) {
      const double off = (centre - on).norm();
      const double share = off > 0.0 ? std::min(kOff, kFarthestOff * length / off) : 0.0;
      const Vec3 place = on + share * (centre - on);
      if ((place - from).squaredNorm() < length * length && !nearly_straight(from, place) &&
          visit(place))
        return true;
    }
  }
  return false;
}

TissueBends::TissueBends(const TissuePaths& paths, const std::function<bool(const Vec3&)>& wanted,
                         const std::function<double(const Vec3&)>& detail)
    : paths_(paths) {
  constexpr double kDistance = 1.0 / 8.0, kDepth = 1.0 / 50.0;  // in details
  constexpr double kLeastBend = 0.035;                          // sine of two degrees
  const TriangleSurface& surface = paths.surface_;
  const auto vertex = [&](int v) -> const Vec3& {
    return surface.vertices[static_cast<std::size_t>(v)];
  };
  // One bend for each direction of its surface in each small cube of space.
  std::set<std::array<long, 6>> taken;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int other = paths.adjacent_[t][i];
      if (other <= static_cast<int>(t)) continue;
      const Vec3 &a = vertex(surface.triangles[t][i]),
                 &b = vertex(surface.triangles[t][(i + 1) % 3]);
      const Vec3 &first = paths.normals_[t],
                 &second = paths.normals_[static_cast<std::size_t>(other)];
      // Concave: the normals cross against the first triangle's sense along the edge.
      if (!(first.cross(second).dot((b - a).stableNormalized()) < -kLeastBend)) continue;
      const Vec3 middle = 0.5 * (a + b);
      if (!wanted(middle) && !wanted(a) && !wanted(b)) continue;
      const double h = detail(middle);
      const Vec3 normal = (first + second).stableNormalized();
      const int count = std::max(1, static_cast<int>(std::ceil((b - a).norm() / (kDistance * h))));
      for (int k = 0; k < count; ++k) {
        const Vec3 on = a + (k + 0.5) / count * (b - a);
        if (!wanted(on)) continue;
        std::array<long, 6> cell;
        for (int c = 0; c < 3; ++c) {
          cell[static_cast<std::size_t>(c)] =
              static_cast<long>(std::floor(on[c] / (kDistance * h)));
          cell[static_cast<std::size_t>(3 + c)] = std::lround(normal[c]);
        }
        if (!taken.insert(cell).second) continue;
        // Below a ridge thinner than that is air.
        const Vec3 below = on - kDepth * h * normal;
        if (paths.tree_.signed_distance(below) < 0.0)
          positions_.push_back(below);
        else
          taken.erase(cell);
      }
    }
  }
  sights_ = KnownPairs(positions_.size());
}

std::vector<TissuePaths::Bend> TissueBends::reached(const Vec3& from, double longest) const {
  const auto see_each_other = [&](int one, int other) {
    return sights_.ask(static_cast<std::size_t>(one), static_cast<std::size_t>(other),
                       [&](std::size_t a, std::size_t b) {
                         return paths_.straight(positions_[a], positions_[b]);
                       });
  };
  // Dijkstra's search. Whether two bends see each other is asked only where that makes a way
  // shorter: to most there is a straight one from the start.
  std::vector<TissuePaths::Bend> bends;
  for (std::size_t b = 0; b < positions_.size(); ++b) {
    const Vec3& x = positions_[b];
    const double direct = (x - from).norm();
    if (direct < longest)
      bends.push_back({x, paths_.straight(from, x) ? direct : longest, static_cast<int>(b)});
  }
  // The nearest that isn't settled comes next; where lengths are the same, the first of them.
  std::vector<char> settled(bends.size(), 0);
  std::size_t next = bends.size();
  const auto offer = [&](std::size_t i, std::size_t& nearest) {
    if (bends[i].length < longest &&
        (nearest == bends.size() || bends[i].length < bends[nearest].length))
      nearest = i;
  };
  for (std::size_t i = 0; i < bends.size(); ++i) offer(i, next);
  while (next < bends.size()) {
    settled[next] = 1;
    std::size_t nearest = bends.size();
    for (std::size_t i = 0; i < bends.size(); ++i) {
      if (settled[i]) continue;
      const double farther = bends[next].length + (bends[i].position - bends[next].position).norm();
      if (farther < bends[i].length && see_each_other(bends[next].number, bends[i].number))
        bends[i].length = farther;
      offer(i, nearest);
    }
    next = nearest;
  }
  std::erase_if(bends, [&](const TissuePaths::Bend& bend) { return bend.length >= longest; });
  return bends;
}

}  // namespace viscera
