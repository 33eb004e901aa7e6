#include "kernels/parting/carve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>

#include "kernels/base/random.h"
#include "kernels/parting/polygon_triangles.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

using Triangle = std::array<int, 3>;

/// A side of triangles, the lower vertex first.
struct Side {
  int low, high;
  Side(int a, int b) : low(std::min(a, b)), high(std::max(a, b)) {}
  std::uint64_t key() const {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(low)) << 32 |
           static_cast<std::uint32_t>(high);
  }
};

/// Two surfaces over the same vertices, and where they meet.
class Meeting {
 public:
  Meeting(const TriangleSurface& body, const TriangleSurface& gone)
      : first_of_gone_(static_cast<int>(body.vertices.size())), at_(body.vertices) {
    at_.insert(at_.end(), gone.vertices.begin(), gone.vertices.end());
    surfaces_[0].triangles = body.triangles;
    surfaces_[1].triangles = gone.triangles;
    for (Triangle& triangle : surfaces_[1].triangles)
      for (int& corner : triangle) corner += first_of_gone_;
    for (One& one : surfaces_) one.cuts.resize(one.triangles.size());
    trees_[0].emplace(body);
    trees_[1].emplace(gone);
  }

  Result<CarvedSurface> carve() {
    if (auto met = find_meetings(); !met) return std::unexpected(met.error());
    for (const std::size_t which : {std::size_t{0}, std::size_t{1}})
      if (auto sorted = sort_out(which); !sorted) return std::unexpected(sorted.error());
    return gather();
  }

 private:
  /// Where a triangle meets one of the other surface: from vertex to vertex.
  struct Cut {
    int from, to;
    int other;
  };
  /// A part of a triangle, as corners in turn.
  struct Part {
    int triangle;
    std::vector<PolygonLoop> loops;
    bool outside;  ///< of the other surface
  };
  struct One {
    std::vector<Triangle> triangles;
    std::vector<std::vector<Cut>> cuts;        // of each triangle
    std::vector<Part> parts;                   // of those that are cut
    std::vector<std::optional<bool>> outside;  // of the others
    /// Of each side that is cut: what lies on it, by the share of the way from its lower vertex.
    std::unordered_map<std::uint64_t, std::vector<std::pair<double, int>>> on_sides;
  };

  const Vec3& at(int vertex) const { return at_[static_cast<std::size_t>(vertex)]; }

  /// Six times the volume of four vertices, the same but for its sign in any order.
  double volume(std::array<int, 4> corners) const {
    bool odd = false;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 3; j > i; --j)
        if (corners[j] < corners[j - 1]) {
          std::swap(corners[j], corners[j - 1]);
          odd = !odd;
        }
    const Vec3 &a = at(corners[0]), &b = at(corners[1]), &c = at(corners[2]), &d = at(corners[3]);
    const double found = (b - a).cross(c - a).dot(d - a);
    return odd ? -found : found;
  }

  /// The vertex where a side of one surface goes through a triangle of the other; -1: it doesn't.
  int crossing(std::size_t which, const Side& side, int number) {
    const auto [found, is_new] = crossings_[which].try_emplace({side.key(), number}, -1);
    if (!is_new) return found->second;
    const auto& [a, b, c] = surfaces_[1 - which].triangles[static_cast<std::size_t>(number)];
    const double low = volume({a, b, c, side.low}), high = volume({a, b, c, side.high});
    if ((low > 0.0) == (high > 0.0)) return -1;
    const bool first = volume({side.low, side.high, a, b}) > 0.0;
    if (first != (volume({side.low, side.high, b, c}) > 0.0) ||
        first != (volume({side.low, side.high, c, a}) > 0.0))
      return -1;
    const double share = std::abs(low) / (std::abs(low) + std::abs(high));
    const int vertex = static_cast<int>(at_.size());
    at_.push_back(Vec3(at(side.low) + share * (at(side.high) - at(side.low))));
    surfaces_[which].on_sides[side.key()].push_back({share, vertex});
    return found->second = vertex;
  }

  Result<void> find_meetings() {
    std::vector<int> near;
    One &body = surfaces_[0], &gone = surfaces_[1];
    for (std::size_t g = 0; g < gone.triangles.size(); ++g) {
      const Box box = box_of(gone.triangles[g]);
      trees_[0]->within(box.center(), 0.5 * box.diagonal().norm(), near);
      for (const int b : near) {
        const auto number = static_cast<std::size_t>(b);
        if (!box_of(body.triangles[number]).intersects(box)) continue;
        std::vector<int> ends;
        for (const auto& [which, triangle, other] :
             {std::tuple(std::size_t{0}, body.triangles[number], static_cast<int>(g)),
              std::tuple(std::size_t{1}, gone.triangles[g], b)})
          for (std::size_t i = 0; i < 3; ++i)
            if (const int end = crossing(which, Side(triangle[i], triangle[(i + 1) % 3]), other);
                end >= 0)
              ends.push_back(end);
        if (ends.empty()) continue;
        if (ends.size() != 2)
          return failure(
              "two surfaces that are to be parted: found triangles that touch without "
              "crossing, expected surfaces in general position");
        body.cuts[number].push_back({ends[0], ends[1], static_cast<int>(g)});
        gone.cuts[g].push_back({ends[0], ends[1], b});
      }
    }
    return {};
  }

  Box box_of(const Triangle& triangle) const {
    Box box;
    for (const int corner : triangle) box.extend(at(corner));
    return box;
  }

  Vec3 normal_of(const Triangle& triangle) const {
    return (at(triangle[1]) - at(triangle[0])).cross(at(triangle[2]) - at(triangle[0]));
  }

  /// Coordinates in the plane of a triangle, anticlockwise as it goes.
  struct Plane {
    Vec3 origin, normal, right, up;

    Vec2 at(const Vec3& x) const {
      const Vec3 from = x - origin;
      return {from.dot(right), from.dot(up)};
    }
  };
  Plane plane_of(const Triangle& triangle) const {
    const Vec3 normal = normal_of(triangle).stableNormalized();
    const Vec3 right = (at(triangle[1]) - at(triangle[0])).stableNormalized();
    return {at(triangle[0]), normal, right, normal.cross(right)};
  }

  /// The vertices on a side of a triangle from one end to the other, without the last.
  PolygonLoop along(const One& one, int from, int to) const {
    PolygonLoop line = {from};
    if (const auto found = one.on_sides.find(Side(from, to).key()); found != one.on_sides.end()) {
      auto on = found->second;
      std::sort(on.begin(), on.end());
      if (from > to) std::reverse(on.begin(), on.end());
      for (const auto& [share, vertex] : on) line.push_back(vertex);
    }
    return line;
  }

  /// Which parts of a surface's triangles lie outside the other surface.
  Result<void> sort_out(std::size_t which) {
    One& one = surfaces_[which];
    one.outside.assign(one.triangles.size(), std::nullopt);
    std::unordered_map<std::uint64_t, std::vector<int>> beside;
    for (std::size_t t = 0; t < one.triangles.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i)
        beside[Side(one.triangles[t][i], one.triangles[t][(i + 1) % 3]).key()].push_back(
            static_cast<int>(t));
    std::vector<std::pair<int, bool>> known;
    for (std::size_t t = 0; t < one.triangles.size(); ++t) {
      if (one.cuts[t].empty()) continue;
      const std::size_t first = one.parts.size();
      if (auto parted = part(which, static_cast<int>(t)); !parted)
        return std::unexpected(parted.error());
      for (std::size_t p = first; p < one.parts.size(); ++p)
        for (const PolygonLoop& loop : one.parts[p].loops)
          for (std::size_t i = 0; i < loop.size(); ++i) {
            const auto found = beside.find(Side(loop[i], loop[(i + 1) % loop.size()]).key());
            if (found == beside.end()) continue;
            for (const int other : found->second)
              if (one.cuts[static_cast<std::size_t>(other)].empty())
                known.push_back({other, one.parts[p].outside});
          }
    }
    spread(one, beside, known);
    for (std::size_t t = 0; t < one.triangles.size(); ++t) {
      if (!one.cuts[t].empty() || one.outside[t]) continue;
      const auto& [a, b, c] = one.triangles[t];
      const Vec3 middle = (at(a) + at(b) + at(c)) / 3.0;
      known.push_back({static_cast<int>(t), trees_[1 - which]->signed_distance(middle) > 0.0});
      spread(one, beside, known);
    }
    return {};
  }

  static void spread(One& one, const std::unordered_map<std::uint64_t, std::vector<int>>& beside,
                     std::vector<std::pair<int, bool>>& known) {
    while (!known.empty()) {
      const auto [number, outside] = known.back();
      known.pop_back();
      const auto t = static_cast<std::size_t>(number);
      if (one.outside[t] || !one.cuts[t].empty()) continue;
      one.outside[t] = outside;
      for (std::size_t i = 0; i < 3; ++i)
        for (const int other :
             beside.at(Side(one.triangles[t][i], one.triangles[t][(i + 1) % 3]).key()))
          known.push_back({other, outside});
    }
  }

  /// Divides a triangle along its cuts.
  Result<void> part(std::size_t which, int number);

  CarvedSurface gather() const;

  struct CrossingKey {
    std::uint64_t side;
    int triangle;
    bool operator==(const CrossingKey&) const = default;
  };
  struct CrossingHash {
    std::size_t operator()(const CrossingKey& key) const {
      return mix64(mix64(key.side) ^ static_cast<std::uint32_t>(key.triangle));
    }
  };

  int first_of_gone_;
  std::vector<Vec3> at_;
  std::array<One, 2> surfaces_;
  std::array<std::optional<SurfaceTree>, 2> trees_;
  /// Of a surface's sides with the other's triangles.
  std::array<std::unordered_map<CrossingKey, int, CrossingHash>, 2> crossings_;
};

/// The ways between a triangle's vertices, its cuts and the parts of its sides, and the loops that
/// they leave. Two-dimensional, in the triangle's plane.
class Division {
 public:
  struct Way {
    int from, to;  // places
    int other;     // the cut's; -1: part of a side
  };

  void add(int from, int to, int other) {
    ways.push_back({from, to, other});
    ways.push_back({to, from, other});
  }

  /// Loops with what they go along; each keeps the same part of the triangle on its left.
  std::vector<std::vector<std::size_t>> loops(const std::vector<Vec2>& places) const {
    std::vector<std::vector<std::size_t>> leaving(places.size());
    for (std::size_t w = 0; w < ways.size(); ++w)
      leaving[static_cast<std::size_t>(ways[w].from)].push_back(w);
    std::vector<double> angle(ways.size());
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const Vec2 way = places[static_cast<std::size_t>(ways[w].to)] -
                       places[static_cast<std::size_t>(ways[w].from)];
      angle[w] = std::atan2(way.y(), way.x());
    }
    std::vector<std::size_t> turn(ways.size());  // place among those that leave its start
    for (auto& all : leaving) {
      std::sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
        return angle[a] < angle[b] || (angle[a] == angle[b] && a < b);
      });
      for (std::size_t i = 0; i < all.size(); ++i) turn[all[i]] = i;
    }
    std::vector<std::vector<std::size_t>> found;
    std::vector<char> taken(ways.size(), 0);
    for (std::size_t start = 0; start < ways.size(); ++start) {
      if (taken[start]) continue;
      std::vector<std::size_t> loop;
      for (std::size_t w = start; !taken[w];) {
        taken[w] = 1;
        loop.push_back(w);
        const std::size_t back = w ^ 1u;
        const auto& all = leaving[static_cast<std::size_t>(ways[w].to)];
        w = all[(turn[back] + all.size() - 1) % all.size()];
      }
      found.push_back(std::move(loop));
    }
    return found;
  }

  std::vector<Way> ways;  // in pairs, there and back
};

Result<void> Meeting::part(std::size_t which, int number) {
  One& one = surfaces_[which];
  const Triangle& triangle = one.triangles[static_cast<std::size_t>(number)];
  const Plane plane = plane_of(triangle);
  std::map<int, int> place_of;
  std::vector<int> vertices;
  std::vector<Vec2> places;
  const auto place = [&](int vertex) {
    const auto [found, is_new] = place_of.try_emplace(vertex, static_cast<int>(places.size()));
    if (is_new) {
      vertices.push_back(vertex);
      places.push_back(plane.at(at(vertex)));
    }
    return found->second;
  };
  Division division;
  for (std::size_t i = 0; i < 3; ++i) {
    PolygonLoop line = along(one, triangle[i], triangle[(i + 1) % 3]);
    line.push_back(triangle[(i + 1) % 3]);
    for (std::size_t k = 0; k + 1 < line.size(); ++k)
      division.add(place(line[k]), place(line[k + 1]), -1);
  }
  for (const Cut& cut : one.cuts[static_cast<std::size_t>(number)])
    division.add(place(cut.from), place(cut.to), cut.other);

  struct Outline {
    PolygonLoop loop;
    double area;  // doubled
    double vote;  // over 0: outside
  };
  std::vector<Outline> outlines;
  for (const auto& loop : division.loops(places)) {
    Outline outline{{}, 0.0, 0.0};
    for (const std::size_t w : loop) {
      const Division::Way& way = division.ways[w];
      outline.loop.push_back(way.from);
      if (way.other < 0) continue;
      const Vec3 along_cut = at(vertices[static_cast<std::size_t>(way.to)]) -
                             at(vertices[static_cast<std::size_t>(way.from)]);
      const Triangle& other = surfaces_[1 - which].triangles[static_cast<std::size_t>(way.other)];
      outline.vote += plane.normal.cross(along_cut).dot(normal_of(other).stableNormalized());
    }
    outline.area = doubled_area(places, outline.loop);
    outlines.push_back(std::move(outline));
  }
  std::vector<Part> parts;
  std::vector<std::size_t> outline_of;
  for (std::size_t o = 0; o < outlines.size(); ++o) {
    if (!(outlines[o].area > 0.0)) continue;
    parts.push_back({number, {outlines[o].loop}, false});
    outline_of.push_back(o);
  }
  if (parts.empty())
    return failure(
        "two surfaces that are to be parted: found a triangle without area, expected "
        "none");
  // A loop that goes clockwise is a hole in the smallest part about it, or goes around all of them.
  const auto shares_corner = [](const PolygonLoop& a, const PolygonLoop& b) {
    return std::any_of(a.begin(), a.end(), [&](int corner) {
      return std::find(b.begin(), b.end(), corner) != b.end();
    });
  };
  std::vector<double> votes;
  for (const std::size_t o : outline_of) votes.push_back(outlines[o].vote);
  for (const Outline& hole : outlines) {
    if (hole.area > 0.0 || hole.loop.size() < 3) continue;
    std::size_t smallest = parts.size();
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const Outline& about = outlines[outline_of[p]];
      if (shares_corner(hole.loop, about.loop) ||
          !lies_within(places, about.loop, places[static_cast<std::size_t>(hole.loop[0])]))
        continue;
      if (smallest == parts.size() || about.area < outlines[outline_of[smallest]].area)
        smallest = p;
    }
    if (smallest == parts.size()) continue;
    parts[smallest].loops.push_back(hole.loop);
    votes[smallest] += hole.vote;
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    parts[p].outside = votes[p] > 0.0;
    for (PolygonLoop& loop : parts[p].loops)
      for (int& corner : loop) corner = vertices[static_cast<std::size_t>(corner)];
    one.parts.push_back(std::move(parts[p]));
  }
  return {};
}

CarvedSurface Meeting::gather() const {
  CarvedSurface carved;
  const auto add = [&](Triangle triangle, int skin, bool turned) {
    if (turned) std::swap(triangle[1], triangle[2]);
    carved.surface.triangles.push_back(triangle);
    carved.skin.push_back(skin);
  };
  for (const std::size_t which : {std::size_t{0}, std::size_t{1}}) {
    const One& one = surfaces_[which];
    const bool is_body = which == 0;
    const auto skin = [&](int triangle) { return is_body ? triangle : -1; };
    for (std::size_t t = 0; t < one.triangles.size(); ++t)
      if (one.outside[t] && *one.outside[t] == is_body)
        add(one.triangles[t], skin(static_cast<int>(t)), !is_body);
    for (const Part& part : one.parts) {
      if (part.outside != is_body) continue;
      const Plane plane = plane_of(one.triangles[static_cast<std::size_t>(part.triangle)]);
      std::vector<int> corners;
      std::vector<Vec2> places;
      std::vector<PolygonLoop> loops;
      for (const PolygonLoop& loop : part.loops) {
        loops.emplace_back();
        for (const int corner : loop) {
          loops.back().push_back(static_cast<int>(corners.size()));
          corners.push_back(corner);
          places.push_back(plane.at(at(corner)));
        }
      }
      for (Triangle piece : polygon_triangles(places, loops)) {
        for (int& corner : piece) corner = corners[static_cast<std::size_t>(corner)];
        add(piece, skin(part.triangle), !is_body);
      }
    }
  }
  // Those of the body first, in its order.
  std::vector<int> numbers(at_.size(), -1);
  for (const Triangle& triangle : carved.surface.triangles)
    for (const int corner : triangle) numbers[static_cast<std::size_t>(corner)] = 0;
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    if (numbers[v] < 0) continue;
    numbers[v] = static_cast<int>(carved.surface.vertices.size());
    carved.surface.vertices.push_back(at_[v]);
    carved.vertices.push_back(static_cast<int>(v) < first_of_gone_ ? static_cast<int>(v) : -1);
  }
  for (Triangle& triangle : carved.surface.triangles)
    for (int& corner : triangle) corner = numbers[static_cast<std::size_t>(corner)];
  return carved;
}

}  // namespace

Result<CarvedSurface> carve(const TriangleSurface& body, const TriangleSurface& gone) {
  return Meeting(body, gone).carve();
}

}  // namespace viscera
