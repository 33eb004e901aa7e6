#include "kernels/points/closed_pieces.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

namespace viscera {
namespace {

std::vector<std::vector<std::array<int, 3>>> connected_parts(const TriangleSurface& surface) {
  std::vector<int> parent(surface.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    auto at = static_cast<std::size_t>(v);
    while (parent[at] != static_cast<int>(at)) {
      parent[at] = parent[static_cast<std::size_t>(parent[at])];
      at = static_cast<std::size_t>(parent[at]);
    }
    return static_cast<int>(at);
  };
  for (const auto& [a, b, c] : surface.triangles) {
    parent[static_cast<std::size_t>(root(b))] = root(a);
    parent[static_cast<std::size_t>(root(c))] = root(a);
  }
  std::map<int, std::size_t> number;
  std::vector<std::vector<std::array<int, 3>>> parts;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const auto [at, fresh] = number.try_emplace(root(triangle[0]), parts.size());
    if (fresh) parts.emplace_back();
    parts[at->second].push_back(triangle);
  }
  return parts;
}

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

std::vector<TriangleSurface> closed_pieces(const TriangleSurface& surface) {
  std::vector<TriangleSurface> bodies, hollows;
  auto parts = connected_parts(surface);
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

}  // namespace viscera
