// Particles sorted into the cells of a dense grid, so that the neighbours of a cell's particles lie
// in nine contiguous runs.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kernels/smoke/smoke_particles.h"

namespace viscera {

/// A grid of cells around the bounding box of the positions, with the edge `cell` [m], or more
/// where the box would need over four million.
BinParameters bin_grid(std::span<const Float4> positions, float cell);
BinParameters bin_grid(const Eigen::AlignedBox3f& box, std::size_t particles, float cell);

inline Int4 cell_of(const BinParameters& grid, const Float4& at) {
  const auto axis = [&](float x, float origin, int size) {
    // Rounding may put the outermost particle one cell too far; what moved out counts as outermost.
    const float cell = (x - origin) * grid.inverse_cell;
    return static_cast<int>(std::min(std::max(1.0f, cell), static_cast<float>(size) - 1.5f));
  };
  return {axis(at.x, grid.origin.x, grid.size.x), axis(at.y, grid.origin.y, grid.size.y),
          axis(at.z, grid.origin.z, grid.size.z), 0};
}

inline std::uint32_t cell_number(const BinParameters& grid, const Int4& cell) {
  return static_cast<std::uint32_t>(cell.x + grid.size.x * (cell.y + grid.size.y * cell.z));
}

struct SmokeBins {
  BinParameters grid;
  std::vector<std::uint32_t> cell_begin;  ///< first particle of each cell, and the end (cells + 1)
  std::vector<std::uint32_t> occupied;    ///< the cells that hold particles, ascending

  using Run = std::pair<std::uint32_t, std::uint32_t>;  ///< first and one past the last particle
  Run own(std::uint32_t cell) const { return {cell_begin[cell], cell_begin[cell + 1]}; }
  /// The particles of the 27 cells about a cell: nine runs of three cells along x.
  std::array<Run, 9> runs(std::uint32_t cell) const {
    std::array<Run, 9> runs;
    for (int i = 0; i < 9; ++i) {
      const int row = grid.size.x * ((i % 3 - 1) + grid.size.y * (i / 3 - 1));
      const std::size_t middle = static_cast<std::size_t>(static_cast<int>(cell) + row);
      runs[i] = {cell_begin[middle - 1], cell_begin[middle + 2]};
    }
    return runs;
  }
  std::size_t memory_bytes() const;

  // Kept between steps, for their memory.
  std::vector<std::uint32_t> particle_cell, order;
  SmokeParticles sorted;
};

/// Reorders the particles by cell: a stable counting sort.
void bin(SmokeParticles& particles, float cell, SmokeBins& bins);

}  // namespace viscera
