#include "kernels/smoke/smoke_bins.h"

#include <algorithm>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 1024;
constexpr double kMostCells = 4e6;

template <class T>
void gather(const std::vector<T>& from, const std::vector<std::uint32_t>& order,
            std::vector<T>& to) {
  to.resize(from.size());
  parallel_for_each_index(order.size(), 4 * kChunk, [&](std::size_t i) { to[i] = from[order[i]]; });
}

}  // namespace

void SmokeBins::sort(SmokeParticles& particles, float support) {
  const std::size_t count = particles.size();
  Eigen::AlignedBox3f bounds;
  for (const Vec3f& position : particles.positions) bounds.extend(position);
  if (count == 0) bounds.extend(Vec3f::Zero());

  float cell = support;
  const auto cells = [&] {
    return ((bounds.sizes() / cell).array().floor().cast<double>() + 3.0).prod();
  };
  while (cells() > kMostCells) cell *= 1.26f;
  inverse_cell_ = 1.0f / cell;
  origin_ = bounds.min();
  size_ = (bounds.sizes() * inverse_cell_).array().floor().cast<int>() + 3;

  particle_cell_.resize(count);
  parallel_for_each_index(count, kChunk, [&](std::size_t i) {
    const Eigen::Vector3i at = cell_of(particles.positions[i]);
    particle_cell_[i] =
        static_cast<std::uint32_t>(at.x() + size_.x() * (at.y() + size_.y() * at.z()));
  });
  cell_begin_.assign(static_cast<std::size_t>(size_.prod()) + 1, 0);
  for (const std::uint32_t c : particle_cell_) ++cell_begin_[c + 1];
  for (std::size_t c = 1; c < cell_begin_.size(); ++c) cell_begin_[c] += cell_begin_[c - 1];

  // Placing particles advances each cell's begin to its end, which is the next cell's begin: shift
  // back afterwards.
  order_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    order_[cell_begin_[particle_cell_[i]]++] = static_cast<std::uint32_t>(i);
  }
  std::copy_backward(cell_begin_.begin(), cell_begin_.end() - 1, cell_begin_.end());
  cell_begin_.front() = 0;

  gather(particles.positions, order_, sorted_.positions);
  gather(particles.velocities, order_, sorted_.velocities);
  gather(particles.temperatures, order_, sorted_.temperatures);
  gather(particles.masses, order_, sorted_.masses);
  gather(particles.ages, order_, sorted_.ages);
  gather(particles.ids, order_, sorted_.ids);
  std::swap(particles, sorted_);
}

Eigen::Vector3i SmokeBins::cell_of(const Vec3f& position) const {
  const Eigen::Vector3i cell =
      ((position - origin_) * inverse_cell_).array().floor().cast<int>() + 1;
  // Rounding may put the outermost particle one cell too far.
  return cell.cwiseMin((size_.array() - 2).matrix());
}

std::array<SmokeBins::Run, 9> SmokeBins::runs(const Vec3f& position) const {
  const Eigen::Vector3i cell = cell_of(position);
  std::array<Run, 9> runs;
  for (int i = 0; i < 9; ++i) {
    const int y = cell.y() + i % 3 - 1;
    const int z = cell.z() + i / 3 - 1;
    const std::size_t row = static_cast<std::size_t>(size_.x()) * (y + size_.y() * z);
    runs[i] = {cell_begin_[row + cell.x() - 1], cell_begin_[row + cell.x() + 2]};
  }
  return runs;
}

std::size_t SmokeBins::memory_bytes() const {
  return (cell_begin_.capacity() + particle_cell_.capacity() + order_.capacity()) *
             sizeof(std::uint32_t) +
         sorted_.memory_bytes();
}

}  // namespace viscera
