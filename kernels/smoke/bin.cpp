#include "kernels/smoke/bin.h"

#include <algorithm>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 4096;
constexpr double kMostCells = 4e6;

Eigen::AlignedBox3f bounding_box(std::span<const Float4> positions) {
  const std::size_t chunks = (positions.size() + kChunk - 1) / kChunk;
  std::vector<Eigen::AlignedBox3f> boxes(chunks);
  parallel_chunks(positions.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    Float4 low = positions[begin], high = low;
    for (const Float4& at : positions.subspan(begin, end - begin)) {
      low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z), 0.0f};
      high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z), 0.0f};
    }
    boxes[begin / kChunk] = Eigen::AlignedBox3f(low.xyz(), high.xyz());
  });
  Eigen::AlignedBox3f all;
  for (const Eigen::AlignedBox3f& box : boxes) all.extend(box);
  if (positions.empty()) all.extend(Vec3f::Zero().eval());
  return all;
}

}  // namespace

BinParameters bin_grid(std::span<const Float4> positions, float cell) {
  return bin_grid(bounding_box(positions), positions.size(), cell);
}

BinParameters bin_grid(const Eigen::AlignedBox3f& box, std::size_t particles, float cell) {
  const auto cells = [&] {
    return ((box.sizes() / cell).array().floor().cast<double>() + 3.0).prod();
  };
  while (cells() > kMostCells) cell *= 1.26f;
  const Eigen::Vector3i size = (box.sizes() / cell).array().floor().cast<int>() + 3;
  BinParameters grid;
  grid.origin = Float4::from(box.min() - Vec3f::Constant(cell));
  grid.size = {size.x(), size.y(), size.z(), size.prod()};
  grid.inverse_cell = 1.0f / cell;
  grid.particles = static_cast<std::uint32_t>(particles);
  return grid;
}

void bin(SmokeParticles& particles, float cell, SmokeBins& bins) {
  const std::size_t count = particles.size();
  const BinParameters grid = bins.grid = bin_grid(particles.positions, cell);
  bins.particle_cell.resize(count);
  parallel_for_each_index(count, kChunk, [&](std::size_t i) {
    bins.particle_cell[i] = cell_number(grid, cell_of(grid, particles.positions[i]));
  });

  std::vector<std::uint32_t>& begin = bins.cell_begin;
  begin.assign(static_cast<std::size_t>(grid.size.w) + 1, 0);
  for (const std::uint32_t c : bins.particle_cell) ++begin[c];
  bins.occupied.clear();
  std::uint32_t first = 0;
  for (std::size_t c = 0; c < begin.size(); ++c) {
    const std::uint32_t here = begin[c];
    if (here > 0) bins.occupied.push_back(static_cast<std::uint32_t>(c));
    begin[c] = first;
    first += here;
  }
  // Placing particles advances each cell's begin to its end, which is the next cell's begin: shift
  // back afterwards.
  bins.order.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    bins.order[begin[bins.particle_cell[i]]++] = static_cast<std::uint32_t>(i);
  }
  std::copy_backward(begin.begin(), begin.end() - 1, begin.end());
  begin.front() = 0;

  bins.sorted.resize(count);
  parallel_for_each_index(count, kChunk,
                          [&](std::size_t i) { bins.sorted.copy(bins.order[i], particles, i); });
  std::swap(particles, bins.sorted);
}

std::size_t SmokeBins::memory_bytes() const {
  return (cell_begin.capacity() + occupied.capacity() + particle_cell.capacity() +
          order.capacity()) *
             sizeof(std::uint32_t) +
         sorted.memory_bytes();
}

}  // namespace viscera
