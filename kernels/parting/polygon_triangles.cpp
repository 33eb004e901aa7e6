#include "kernels/parting/polygon_triangles.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

namespace viscera {
namespace {

double turn(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Whether the ways between two pairs of places cross between their ends.
bool cross(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  return (turn(a, b, c) > 0.0) != (turn(a, b, d) > 0.0) &&
         (turn(c, d, a) > 0.0) != (turn(c, d, b) > 0.0);
}

const Vec2& at(std::span<const Vec2> places, int corner) {
  return places[static_cast<std::size_t>(corner)];
}

/// One loop of both, by a way there and back between corners that see each other.
PolygonLoop joined(std::span<const Vec2> places, const PolygonLoop& outer, const PolygonLoop& hole,
                   const std::vector<PolygonLoop>& holes) {
  struct Bridge {
    double length;
    std::size_t from, to;
  };
  std::vector<Bridge> bridges;
  for (std::size_t i = 0; i < outer.size(); ++i)
    for (std::size_t j = 0; j < hole.size(); ++j)
      bridges.push_back({(at(places, outer[i]) - at(places, hole[j])).squaredNorm(), i, j});
  std::sort(bridges.begin(), bridges.end(),
            [](const Bridge& a, const Bridge& b) { return a.length < b.length; });
  const auto meets = [&](const PolygonLoop& loop, int from, int to) {
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const int c = loop[k], d = loop[(k + 1) % loop.size()];
      if (c == from || c == to || d == from || d == to) continue;
      if (cross(at(places, from), at(places, to), at(places, c), at(places, d))) return true;
    }
    return false;
  };
  Bridge best = bridges.front();
  for (const Bridge& bridge : bridges) {
    const int from = outer[bridge.from], to = hole[bridge.to];
    if (meets(outer, from, to) || std::any_of(holes.begin(), holes.end(), [&](const auto& other) {
          return meets(other, from, to);
        }))
      continue;
    best = bridge;
    break;
  }
  PolygonLoop all(outer.begin(), outer.begin() + static_cast<std::ptrdiff_t>(best.from) + 1);
  for (std::size_t k = 0; k <= hole.size(); ++k) all.push_back(hole[(best.to + k) % hole.size()]);
  all.insert(all.end(), outer.begin() + static_cast<std::ptrdiff_t>(best.from), outer.end());
  return all;
}

/// Twice a triangle's area over its longest side squared: .87 where its sides are equal, 0 without
/// area, negative clockwise.
double shape_of(std::span<const Vec2> places, int ia, int ib, int ic) {
  const Vec2 &a = at(places, ia), &b = at(places, ib), &c = at(places, ic);
  const double longest =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return longest > 0.0 ? turn(a, b, c) / longest : 0.0;
}

/// Turns sides between two triangles while that makes the worse of them better: corners that lie on
/// one line, as where flat walls meet flat skin, leave triangles without area to the last ears.
void turn_sides(std::span<const Vec2> places, std::vector<std::array<int, 3>>& triangles) {
  const std::size_t most = 10 * triangles.size();
  std::size_t turned = 0;
  for (bool again = true; again && turned < most;) {
    again = false;
    std::map<std::pair<int, int>, std::size_t> of_side;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) of_side[{triangles[t][i], triangles[t][(i + 1) % 3]}] = t;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const int p = triangles[t][i], q = triangles[t][(i + 1) % 3], r = triangles[t][(i + 2) % 3];
        const auto found = of_side.find({q, p});
        if (found == of_side.end()) continue;
        const std::size_t second = found->second;
        std::array<int, 3>& other = triangles[second];
        const auto k =
            static_cast<std::size_t>(std::find(other.begin(), other.end(), q) - other.begin());
        const int s = other[(k + 2) % 3];
        if (s == r || of_side.contains({r, s}) || of_side.contains({s, r})) continue;
        const double before = std::min(shape_of(places, p, q, r), shape_of(places, q, p, s));
        const double after = std::min(shape_of(places, p, s, r), shape_of(places, s, q, r));
        constexpr double kBetter = 1e-9;
        if (!(after > before + kBetter)) continue;
        for (const auto& [a, b] : {std::pair(p, q), {q, r}, {r, p}, {q, p}, {p, s}, {s, q}})
          of_side.erase({a, b});
        triangles[t] = {p, s, r};
        other = {s, q, r};
        for (const std::size_t one : {t, second})
          for (std::size_t j = 0; j < 3; ++j)
            of_side[{triangles[one][j], triangles[one][(j + 1) % 3]}] = one;
        ++turned;
        again = true;
        break;
      }
    }
  }
}

}  // namespace

double doubled_area(std::span<const Vec2> places, const PolygonLoop& loop) {
  double sum = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec2 &a = at(places, loop[i]), &b = at(places, loop[(i + 1) % loop.size()]);
    const Vec2& first = at(places, loop[0]);
    sum += turn(first, a, b);
  }
  return sum;
}

bool lies_within(std::span<const Vec2> places, const PolygonLoop& loop, const Vec2& place) {
  bool within = false;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec2 &a = at(places, loop[i]), &b = at(places, loop[(i + 1) % loop.size()]);
    if ((a.y() > place.y()) == (b.y() > place.y())) continue;
    const double x = a.x() + (place.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (place.x() < x) within = !within;
  }
  return within;
}

std::vector<std::array<int, 3>> polygon_triangles(std::span<const Vec2> places,
                                                  const std::vector<PolygonLoop>& loops) {
  PolygonLoop rest = loops.front();
  const std::vector<PolygonLoop> holes(loops.begin() + 1, loops.end());
  for (const PolygonLoop& hole : holes) rest = joined(places, rest, hole, holes);

  /// How well an ear is shaped; 0 or less where it is none.
  const auto shape = [&](std::size_t i) {
    const std::size_t n = rest.size();
    const int ia = rest[(i + n - 1) % n], ib = rest[i], ic = rest[(i + 1) % n];
    const Vec2 &a = at(places, ia), &b = at(places, ib), &c = at(places, ic);
    const double found = shape_of(places, ia, ib, ic);
    if (!(found > 0.0)) return found - 1.0;
    for (const int other : rest) {
      if (other == ia || other == ib || other == ic) continue;
      const Vec2& x = at(places, other);
      if (turn(a, b, x) >= 0.0 && turn(b, c, x) >= 0.0 && turn(c, a, x) >= 0.0) return -1.0;
    }
    return found;
  };
  std::vector<std::array<int, 3>> triangles;
  while (rest.size() > 3) {
    const std::size_t n = rest.size();
    std::size_t best = 0;
    double best_shape = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < n; ++i)
      if (const double found = shape(i); found > best_shape) {
        best_shape = found;
        best = i;
      }
    triangles.push_back({rest[(best + n - 1) % n], rest[best], rest[(best + 1) % n]});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(best));
  }
  if (rest.size() == 3) triangles.push_back({rest[0], rest[1], rest[2]});
  turn_sides(places, triangles);
  return triangles;
}

}  // namespace viscera
