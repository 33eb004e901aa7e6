#include "kernels/points/surface_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "kernels/base/disjoint_sets.h"

namespace viscera {

namespace {

// A triangle whose height is less than this share of its longest edge has no usable normal.
constexpr double kFlatness = 1e-9;

std::string place(const Vec3& x) {
  std::array<char, 96> text;
  std::snprintf(text.data(), text.size(), "(%.4g, %.4g, %.4g mm)", 1e3 * x.x(), 1e3 * x.y(),
                1e3 * x.z());
  return text.data();
}

std::string count_of(std::size_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string vertex_text(const TriangleSurface& surface, int vertex) {
  return std::to_string(vertex) + " " + place(surface.vertices[vertex]);
}

std::string edge_text(const TriangleSurface& surface, int from, int to) {
  return "between vertices " + vertex_text(surface, from) + " and " + vertex_text(surface, to);
}

/// One side of a triangle; sorted by its vertices, sides of one edge stand together.
struct Side {
  int low, high;  // vertices, low < high
  int triangle;
  bool forward;  // the triangle runs through it from low to high

  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
};

std::vector<Side> sorted_sides(const TriangleSurface& surface) {
  std::vector<Side> sides;
  sides.reserve(3 * surface.triangles.size());
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    for (int i = 0; i < 3; ++i) {
      const int from = surface.triangles[t][i], to = surface.triangles[t][(i + 1) % 3];
      if (from != to) sides.push_back({std::min(from, to), std::max(from, to), t, from < to});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::array{a.low, a.high, a.triangle} < std::array{b.low, b.high, b.triangle};
  });
  return sides;
}

/// Defects that make every other check meaningless.
std::vector<std::string> unreadable(const TriangleSurface& surface) {
  if (surface.triangles.empty()) return {"empty: no triangles"};
  std::vector<std::string> defects;

  const int vertices = static_cast<int>(surface.vertices.size());
  std::size_t outside = 0, first_outside = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const bool bad =
        std::ranges::any_of(surface.triangles[t], [&](int v) { return v < 0 || v >= vertices; });
    if (bad && outside++ == 0) first_outside = t;
  }
  if (outside > 0) {
    const std::array<int, 3>& t = surface.triangles[first_outside];
    defects.push_back("index out of range: " + count_of(outside, "triangle") + ", the first is " +
                      std::to_string(first_outside) + " (" + std::to_string(t[0]) + ", " +
                      std::to_string(t[1]) + ", " + std::to_string(t[2]) + "), expected 0 to " +
                      std::to_string(vertices - 1));
  }

  std::size_t strange = 0, first_strange = 0;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    if (!surface.vertices[v].allFinite() && strange++ == 0) first_strange = v;
  }
  if (strange > 0) {
    defects.push_back("non-finite coordinates: at " + std::to_string(strange) +
                      " of the vertices, the first is " +
                      vertex_text(surface, static_cast<int>(first_strange)));
  }
  return defects;
}

std::size_t count_flat(const TriangleSurface& surface, int& first) {
  std::size_t flat = 0;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3 &p = surface.vertices[a], &q = surface.vertices[b], &r = surface.vertices[c];
    const double longest2 =
        std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()});
    const bool is_flat = 2.0 * area_vector(surface, t).norm() <= kFlatness * longest2;
    if (is_flat && flat++ == 0) first = t;
  }
  return flat;
}

}  // namespace

std::vector<std::string> surface_defects(const TriangleSurface& surface) {
  std::vector<std::string> defects = unreadable(surface);
  if (!defects.empty()) return defects;

  int first_flat = 0;
  if (const std::size_t flat = count_flat(surface, first_flat); flat > 0) {
    const auto& [a, b, c] = surface.triangles[first_flat];
    defects.push_back("zero area: " + count_of(flat, "triangle") + ", the first is " +
                      std::to_string(first_flat) + " with vertices " + vertex_text(surface, a) +
                      ", " + vertex_text(surface, b) + " and " + vertex_text(surface, c));
  }

  const std::vector<Side> sides = sorted_sides(surface);
  DisjointSets pieces(surface.triangles.size());
  std::size_t open = 0, crowded = 0, flipped = 0;
  const Side *first_open = nullptr, *first_crowded = nullptr, *first_flipped = nullptr;
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    for (end = begin + 1; end < sides.size() && sides[end].same_edge(sides[begin]); ++end) {
      pieces.join(sides[begin].triangle, sides[end].triangle);
    }
    if (end - begin == 1 && open++ == 0) first_open = &sides[begin];
    if (end - begin > 2 && crowded++ == 0) first_crowded = &sides[begin];
    if (end - begin == 2 && sides[begin].forward == sides[begin + 1].forward && flipped++ == 0) {
      first_flipped = &sides[begin];
    }
  }
  if (open > 0) {
    defects.push_back("open: " + count_of(open, "boundary edge") + ", the first " +
                      edge_text(surface, first_open->low, first_open->high));
  }
  if (crowded > 0) {
    defects.push_back("non-manifold: " + count_of(crowded, "edge") +
                      " with more than two triangles, the first " +
                      edge_text(surface, first_crowded->low, first_crowded->high));
  }
  if (flipped > 0) {
    defects.push_back("inconsistent orientation: " + count_of(flipped, "edge") +
                      " between triangles that turn opposite ways, the first " +
                      edge_text(surface, first_flipped->low, first_flipped->high));
  }

  // The sign of the volume means something only for a closed surface that turns one way.
  if (open == 0 && crowded == 0 && flipped == 0) {
    const double enclosed = volume(surface);
    if (!(enclosed > 0.0)) {
      std::array<char, 32> millilitres;
      std::snprintf(millilitres.data(), millilitres.size(), "%.4g", 1e6 * enclosed);
      defects.push_back("inside-out: the enclosed volume is " + std::string(millilitres.data()) +
                        " ml, expected a positive one (triangles counter-clockwise seen from "
                        "outside)");
    }
  }

  std::size_t piece_count = 0;
  int second_piece = -1;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    if (pieces.root(t) == t && ++piece_count == 2) second_piece = t;
  }
  if (piece_count > 1) {
    defects.push_back("disconnected: " + std::to_string(piece_count) +
                      " pieces, expected one; the second begins at triangle " +
                      std::to_string(second_piece) + ", vertex " +
                      vertex_text(surface, surface.triangles[second_piece][0]));
  }
  return defects;
}

}  // namespace viscera
