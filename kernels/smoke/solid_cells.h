// Which cells of a coarse grid lie inside closed surfaces: what the gas can't enter.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// Cells x fastest; `origin` the least corner [m].
struct SolidGrid {
  Vec3 origin = Vec3::Zero();
  Vec3 spacing = Vec3::Ones();  ///< of a cell [m]
  std::array<int, 3> cells = {0, 0, 0};

  std::size_t size() const {
    return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) *
           static_cast<std::size_t>(cells[2]);
  }
};

/// Sets to 1 the cells whose middles lie inside a closed triangle surface, and leaves the others as
/// they are. A line along z through each column of middles crosses the surface an even number of
/// times, and every second stretch is inside: triangles that share an edge share its line to the
/// last bit, so none is met twice or slips through. `vertices` in the surface's own frame [m].
void mark_solid(std::span<const Vec3f> vertices, std::span<const std::array<int, 3>> triangles,
                const Pose& pose, const SolidGrid& grid, std::span<std::uint8_t> solid);

}  // namespace viscera
