#include "engine/organ/isosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
namespace {

using Index = Eigen::Vector3i;

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
        const Index at = cell + Index(c & 1, c >> 1 & 1, c >> 2);
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

  int number(std::uint64_t key) const { return numbers_.find(key)->second; }
  double value(int number) const { return values_[number]; }

 private:
  std::vector<std::uint64_t> keys_;
  std::vector<double> values_;
  std::unordered_map<std::uint64_t, int> numbers_;
};

// Freudenthal's six tetrahedra of a cube about the diagonal from corner 0 to corner 7; neighbouring
// cubes split their common face the same way. Each is positively oriented.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

class Marcher {
 public:
  Marcher(const Grid& grid, const Corners& corners) : grid_(grid), corners_(corners) {}

  void visit(const Index& cell) {
    std::array<Corner, 8> corner;
    int inside = 0;
    for (int c = 0; c < 8; ++c) {
      const Index at = cell + Index(c & 1, c >> 1 & 1, c >> 2);
      const int number = corners_.number(grid_.key(at));
      corner[c] = {at, number, corners_.value(number)};
      inside += corner[c].value < 0.0;
    }
    if (inside == 0 || inside == 8) return;
    for (const auto& [a, b, c, d] : kTetrahedra) {
      tetrahedron({&corner[a], &corner[b], &corner[c], &corner[d]});
    }
  }

  TriangleSurface take() { return std::move(surface_); }

 private:
  struct Corner {
    Index at;
    int number;
    double value;
  };

  void tetrahedron(std::array<const Corner*, 4> c) {
    // Bring the inside corners to the front by even permutations, which keep the orientation.
    const auto in = [&c](int i) { return c[i]->value < 0.0; };
    const int inside = in(0) + in(1) + in(2) + in(3);
    if (inside == 0 || inside == 4) return;
    const auto rotate = [&c](int i, int j, int k) {
      const Corner* first = c[i];
      c[i] = c[j];
      c[j] = c[k];
      c[k] = first;
    };
    if (inside == 1) {
      if (in(1))
        rotate(0, 1, 2);
      else if (in(2))
        rotate(0, 2, 1);
      else if (in(3))
        rotate(0, 3, 1);
      triangle(cut(c[0], c[1]), cut(c[0], c[2]), cut(c[0], c[3]));
    } else if (inside == 3) {
      if (!in(1))
        rotate(0, 1, 2);
      else if (!in(2))
        rotate(0, 2, 1);
      else if (!in(3))
        rotate(0, 3, 1);
      triangle(cut(c[0], c[1]), cut(c[0], c[3]), cut(c[0], c[2]));
    } else {
      if (in(0)) {
        if (in(2))
          rotate(1, 2, 3);
        else if (in(3))
          rotate(1, 3, 2);
      } else if (in(1)) {
        if (in(2))
          rotate(0, 1, 2);
        else
          rotate(0, 1, 3);
      } else {
        rotate(0, 2, 1);
        rotate(1, 3, 2);
      }
      const int p = cut(c[0], c[2]), q = cut(c[0], c[3]), r = cut(c[1], c[3]), s = cut(c[1], c[2]);
      triangle(p, q, r);
      triangle(p, r, s);
    }
  }

  void triangle(int a, int b, int c) { surface_.triangles.push_back({a, b, c}); }

  int cut(const Corner* a, const Corner* b) {
    if (a->number > b->number) std::swap(a, b);
    const std::uint64_t key = static_cast<std::uint64_t>(a->number) << 32 | b->number;
    const auto [entry, fresh] = cuts_.try_emplace(key, surface_.vertices.size());
    if (fresh) {
      // Kept away from corners, so that no triangle begins with zero area.
      const double share = std::clamp(a->value / (a->value - b->value), 0.05, 0.95);
      surface_.vertices.push_back((1.0 - share) * grid_.corner(a->at) +
                                  share * grid_.corner(b->at));
    }
    return entry->second;
  }

  const Grid& grid_;
  const Corners& corners_;
  std::unordered_map<std::uint64_t, int> cuts_;
  TriangleSurface surface_;
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

// Orientation is decided once, by the sign of the field, in `tetrahedron`.
TriangleSurface march(const SignedDistance& distance, const Grid& grid,
                      const std::vector<Index>& cells) {
  const Corners corners(distance, grid, cells);
  Marcher marcher(grid, corners);
  for (const Index& cell : cells) marcher.visit(cell);
  return marcher.take();
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
  std::vector<int> number(surface.vertices.size(), -1);
  for (const auto& part : connected_triangles(surface)) {
    TriangleSurface& piece = pieces.emplace_back();
    for (const auto& triangle : part) {
      std::array<int, 3> renumbered;
      for (int i = 0; i < 3; ++i) {
        int& to = number[triangle[i]];
        if (to < 0) {
          to = static_cast<int>(piece.vertices.size());
          piece.vertices.push_back(surface.vertices[triangle[i]]);
        }
        renumbered[i] = to;
      }
      piece.triangles.push_back(renumbered);
    }
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const auto& a, const auto& b) { return volume(a) > volume(b); });
  return pieces;
}

}  // namespace viscera
