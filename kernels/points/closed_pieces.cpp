#include "kernels/points/closed_pieces.h"

#include <algorithm>
#include <map>
#include <utility>

#include "kernels/base/disjoint_sets.h"

namespace viscera {
namespace {

/// Each edge is run through as often one way as the other.
bool is_closed(const TriangleSurface& surface) {
  std::map<std::pair<int, int>, int> runs;
  for (const std::array<int, 3>& triangle : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = triangle[i], b = triangle[(i + 1) % 3];
      runs[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  return std::all_of(runs.begin(), runs.end(), [](const auto& one) { return one.second == 0; });
}

Box extent(const TriangleSurface& surface) {
  Box box;
  for (const std::array<int, 3>& triangle : surface.triangles)
    for (const int v : triangle) box.extend(surface.vertices[static_cast<std::size_t>(v)]);
  return box;
}

}  // namespace

std::vector<std::vector<std::array<int, 3>>> connected_triangles(const TriangleSurface& surface) {
  DisjointSets sets(surface.vertices.size());
  for (const auto& [a, b, c] : surface.triangles) {
    sets.join(a, b);
    sets.join(a, c);
  }
  std::vector<int> number(surface.vertices.size(), -1);
  std::vector<std::vector<std::array<int, 3>>> parts;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    int& part = number[static_cast<std::size_t>(sets.root(triangle[0]))];
    if (part < 0) {
      part = static_cast<int>(parts.size());
      parts.emplace_back();
    }
    parts[static_cast<std::size_t>(part)].push_back(triangle);
  }
  return parts;
}

std::vector<TriangleSurface> closed_pieces(const TriangleSurface& surface) {
  std::vector<TriangleSurface> bodies, hollows;
  auto parts = connected_triangles(surface);
  if (parts.size() < 2) return {surface};
  for (auto& part : parts) {
    TriangleSurface piece{surface.vertices, std::move(part)};
    if (!is_closed(piece)) return {surface};
    (volume(piece) > 0.0 ? bodies : hollows).push_back(std::move(piece));
  }
  for (const TriangleSurface& hollow : hollows) {
    const Box inner = extent(hollow);
    TriangleSurface* about = nullptr;
    double least = 0.0;
    for (TriangleSurface& body : bodies) {
      const Box outer = extent(body);
      if (!outer.contains(inner) || (about && outer.volume() >= least)) continue;
      about = &body;
      least = outer.volume();
    }
    if (!about) return {surface};
    about->triangles.insert(about->triangles.end(), hollow.triangles.begin(),
                            hollow.triangles.end());
  }
  return bodies;
}

std::vector<int> pieces_of_vertices(const TriangleSurface& surface,
                                    const std::vector<TriangleSurface>& pieces) {
  if (pieces.size() < 2) return {};
  std::vector<int> numbers(surface.vertices.size(), 0);
  for (std::size_t p = 0; p < pieces.size(); ++p)
    for (const std::array<int, 3>& triangle : pieces[p].triangles)
      for (const int corner : triangle)
        numbers[static_cast<std::size_t>(corner)] = static_cast<int>(p);
  return numbers;
}

}  // namespace viscera
