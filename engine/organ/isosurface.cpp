#include "engine/organ/isosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/points/closed_pieces.h"
#include "kernels/points/marching_tetrahedra.h"

namespace viscera {
namespace {

using Index = MarchingTetrahedra::Index;

// Fields whose slope exceeds this somewhere may lose cells; the open surface is then noticed, and
// every cell is visited instead.
constexpr double kGreatestSlope = 1.8;

struct Grid {
  Vec3 origin;
  double cell;
  Index cells;  // (3)

  Vec3 corner(const Index& i) const { return origin + cell * i.cast<double>(); }
  std::uint64_t key(const Index& i) const {
    return (static_cast<std::uint64_t>(i.z()) * (cells.y() + 1) + i.y()) * (cells.x() + 1) + i.x();
  }
};

// Cells that the zero set may cross.
std::vector<Index> near_cells(const SignedDistance& distance, const Grid& grid) {
  int size = 1;
  while (size < 32 && 8 * size < grid.cells.maxCoeff()) size *= 2;
  std::vector<Index> blocks;
  for (int z = 0; z < grid.cells.z(); z += size) {
    for (int y = 0; y < grid.cells.y(); y += size) {
      for (int x = 0; x < grid.cells.x(); x += size) blocks.emplace_back(x, y, z);
    }
  }
  while (true) {
    const double reach = kGreatestSlope * 0.5 * std::sqrt(3.0) * size * grid.cell;
    std::vector<char> kept(blocks.size());
    parallel_for_each_index(blocks.size(), 256, [&](std::size_t i) {
      const Vec3 centre = grid.corner(blocks[i]) + Vec3::Constant(0.5 * size * grid.cell);
      kept[i] = !(std::abs(distance(centre)) > reach);
    });
    std::vector<Index> next;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (!kept[i]) continue;
      if (size == 1) {
        next.push_back(blocks[i]);
        continue;
      }
      for (int child = 0; child < 8; ++child) {
        const Index at = blocks[i] + size / 2 * Index(child & 1, child >> 1 & 1, child >> 2);
        if ((at.array() < grid.cells.array()).all()) next.push_back(at);
      }
    }
    blocks = std::move(next);
    if (size == 1) return blocks;
    size /= 2;
  }
}

std::vector<Index> all_cells(const Grid& grid) {
  std::vector<Index> cells;
  for (int z = 0; z < grid.cells.z(); ++z) {
    for (int y = 0; y < grid.cells.y(); ++y) {
      for (int x = 0; x < grid.cells.x(); ++x) cells.emplace_back(x, y, z);
    }
  }
  return cells;
}

// Field values at the corners of cells.
class Corners {
 public:
  Corners(const SignedDistance& distance, const Grid& grid, const std::vector<Index>& cells) {
    std::vector<std::pair<std::uint64_t, Index>> corners;
    corners.reserve(8 * cells.size());
    for (const Index& cell : cells) {
      for (int c = 0; c < 8; ++c) {
        const Index at = MarchingTetrahedra::corner(cell, c);
        corners.emplace_back(grid.key(at), at);
      }
    }
    const auto by_key = [](const auto& a, const auto& b) { return a.first < b.first; };
    std::sort(corners.begin(), corners.end(), by_key);
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    corners.erase(std::unique(corners.begin(), corners.end(), same), corners.end());
    keys_.resize(corners.size());
    values_.resize(corners.size());
    parallel_for_each_index(corners.size(), 256, [&](std::size_t i) {
      keys_[i] = corners[i].first;
      values_[i] = distance(grid.corner(corners[i].second));
    });
    numbers_.reserve(keys_.size());
    for (std::size_t i = 0; i < keys_.size(); ++i) numbers_.emplace(keys_[i], static_cast<int>(i));
  }

  double value(std::uint64_t key) const { return values_[numbers_.find(key)->second]; }

 private:
  std::vector<std::uint64_t> keys_;
  std::vector<double> values_;
  std::unordered_map<std::uint64_t, int> numbers_;
};

bool is_closed(const TriangleSurface& surface) {
  std::vector<std::uint64_t> sides;
  sides.reserve(3 * surface.triangles.size());
  for (const auto& triangle : surface.triangles) {
    for (int i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax(triangle[i], triangle[(i + 1) % 3]);
      sides.push_back(static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint64_t>(high));
    }
  }
  std::sort(sides.begin(), sides.end());
  if (sides.size() % 2 != 0) return false;
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    if (sides[i] != sides[i + 1]) return false;
    if (i + 2 < sides.size() && sides[i + 1] == sides[i + 2]) return false;
  }
  return true;
}

TriangleSurface march(const SignedDistance& distance, const Grid& grid,
                      const std::vector<Index>& cells) {
  const Corners corners(distance, grid, cells);
  MarchingTetrahedra marching([&](const Index& at) { return grid.corner(at); });
  for (const Index& cell : cells) {
    std::array<double, 8> values;
    for (int c = 0; c < 8; ++c)
      values[static_cast<std::size_t>(c)] =
          corners.value(grid.key(MarchingTetrahedra::corner(cell, c)));
    marching.visit(cell, values);
  }
  return marching.take();
}

}  // namespace

Result<TriangleSurface> marching_tetrahedra(const SignedDistance& distance, const Box& box,
                                            double cell) {
  const Vec3 size = box.sizes();
  const Index cells = (size / cell).array().ceil().cast<int>().max(2);
  // Centred, so that a symmetric body in a symmetric box is cut symmetrically.
  const Grid grid{box.center() - 0.5 * cell * cells.cast<double>(), cell, cells};

  TriangleSurface surface = march(distance, grid, near_cells(distance, grid));
  if (surface.empty() || !is_closed(surface)) surface = march(distance, grid, all_cells(grid));
  if (surface.empty()) {
    return failure("found no body inside its box at cells of " + std::to_string(1e3 * cell) +
                   " mm, expected one");
  }
  if (!is_closed(surface)) {
    const Box found = bounds(surface);
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool high : {false, true}) {
        const double wall = high ? grid.corner(cells)[axis] : grid.origin[axis];
        const double reached = high ? found.max()[axis] : found.min()[axis];
        if (std::abs(wall - reached) < 1e-6 * cell) {
          return failure(std::string("the body leaves its box at ") + "xyz"[axis] + " = " +
                         std::to_string(1e3 * wall) + " mm, expected a box that encloses it");
        }
      }
    }
    return failure("the zero set isn't closed: is the field continuous and finite?");
  }
  return surface;
}

std::vector<TriangleSurface> pieces_of(const TriangleSurface& surface) {
  std::vector<TriangleSurface> pieces;
  for (auto& part : connected_triangles(surface))
    pieces.push_back(with_used_vertices({surface.vertices, std::move(part)}));
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const auto& a, const auto& b) { return volume(a) > volume(b); });
  return pieces;
}

}  // namespace viscera
