#include "kernels/smoke/splat.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "kernels/base/lanes.h"
#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr int kSlab = 4;      // layers of cells that one task fills
constexpr int kChannels = 5;  // mass, heat, momentum
constexpr std::size_t kChunk = 4096;
/// What the greatest particle puts into one cell at most: below 2^31, and 2^33 of them below 2^63.
constexpr float kSteps = 0x1p30f;

/// The weights of a tent along one axis, on cells inside the grid, with the sum 1.
struct Tent {
  int first = 0, count = 0;
  alignas(32) std::array<float, kWidestSplat> weights;

  // `at` and `radius` in cells, cell i spans [i, i + 1).
  Tent(float at, float radius, int size) {
    first = std::clamp(static_cast<int>(std::floor(at - radius + 0.5f)), 0, size - 1);
    const int last = std::clamp(static_cast<int>(std::floor(at + radius - 0.5f)), first, size - 1);
    count = std::min(last - first + 1, kWidestSplat);
    const float inverse = 1.0f / radius;
    float sum = 0.0f;
    for (int i = 0; i < count; ++i) {
      const float distance = std::abs(static_cast<float>(first + i) + 0.5f - at);
      weights[i] = std::max(0.0f, 1.0f - distance * inverse);
      sum += weights[i];
    }
    if (!(sum > 0.0f)) {
      count = 1;
      sum = weights[0] = 1.0f;
    }
    const float norm = 1.0f / sum;
    for (int i = 0; i < count; ++i) weights[i] *= norm;
    for (int i = count; i % kLanes != 0; ++i) weights[i] = 0.0f;
  }
};

/// Fixed-point sums of a slab's cells; rows are long enough for whole lanes.
struct Slab {
  std::int64_t* sums;
  std::size_t row, layer, channel;  // lengths
};

struct Eight {
  using Weights = float __attribute__((vector_size(32)));
  using Steps = std::int32_t __attribute__((vector_size(32)));
  using Sums = std::int64_t __attribute__((vector_size(64)));
};
struct Four {
  using Weights = float __attribute__((vector_size(16)));
  using Steps = std::int32_t __attribute__((vector_size(16)));
  using Sums = std::int64_t __attribute__((vector_size(32)));
};

/// Adds amount * weights to eight or four cells of a row, rounded to steps.
template <class Cells>
VISCERA_INLINE void add_cells(std::int64_t* row, const float* weights, float amount) {
  typename Cells::Weights w;
  typename Cells::Sums sums;
  std::memcpy(&w, weights, sizeof w);
  std::memcpy(&sums, row, sizeof sums);
  w = amount * w + (amount < 0.0f ? -0.5f : 0.5f);
  const typename Cells::Steps steps = __builtin_convertvector(w, typename Cells::Steps);
  sums += __builtin_convertvector(steps, typename Cells::Sums);
  std::memcpy(row, &sums, sizeof sums);
}

VISCERA_WIDE void add_particle(const Slab& slab, const Tent& x, const Tent& y, const Tent& z,
                               int low, int z_begin, int z_end, const float* amounts) {
  for (int cz = z_begin; cz < z_end; ++cz) {
    for (int cy = 0; cy < y.count; ++cy) {
      const float weight = z.weights[cz - z.first] * y.weights[cy];
      std::int64_t* row = slab.sums + slab.layer * static_cast<std::size_t>(cz - low) +
                          slab.row * static_cast<std::size_t>(y.first + cy) + x.first;
      for (int c = 0; c < kChannels; ++c, row += slab.channel) {
        const float amount = weight * amounts[c];
        int i = 0;
        for (; i + 4 < x.count; i += kLanes)
          add_cells<Eight>(row + i, x.weights.data() + i, amount);
        if (i < x.count) add_cells<Four>(row + i, x.weights.data() + i, amount);
      }
    }
  }
}

SplatAmounts greatest(std::span<const Float4> positions, std::span<const Float4> velocities,
                      std::span<const float> masses) {
  SplatAmounts most;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const Float4& v = velocities[i];
    most.mass = std::max(most.mass, masses[i]);
    most.heat = std::max(most.heat, masses[i] * std::abs(positions[i].w));
    most.momentum = std::max(most.momentum,
                             masses[i] * std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
  }
  return most;
}

float scale_of(float most) {
  return most > 0.0f ? std::min(kSteps / most, 1e37f) : 1.0f;
}

}  // namespace

void set_scales(const SplatAmounts& greatest, SplatParameters& parameters) {
  parameters.mass_scale = scale_of(greatest.mass);
  parameters.heat_scale = scale_of(greatest.heat);
  parameters.momentum_scale = scale_of(greatest.momentum);
}

SplatParameters splat_parameters(const Box& domain, double voxel, double support,
                                 double viscosity) {
  assert(voxel > 0.0);
  SplatParameters parameters;
  // A hundredth of a cell less, so that a domain of whole cells doesn't gain one by rounding.
  const Vec3 cells = (domain.sizes() / voxel).array() - 0.01;
  const Eigen::Vector3i size = cells.array().ceil().max(1.0).cast<int>();
  parameters.size = {size.x(), size.y(), size.z(), size.prod()};
  parameters.inverse_voxel = static_cast<float>(1.0 / voxel);
  parameters.first_square = static_cast<float>(0.25 * support * support);
  parameters.growth = static_cast<float>(12.0 * viscosity);
  parameters.widest = static_cast<float>(2.5 * support);
  return parameters;
}

void splat(std::span<const Float4> positions, std::span<const Float4> velocities,
           std::span<const float> masses, SplatParameters& parameters, SmokeGrid& grid) {
  const std::size_t count = positions.size();
  const Int4& size = parameters.size;
  const float inverse_voxel = parameters.inverse_voxel;
  const std::size_t layer = static_cast<std::size_t>(size.x) * size.y;
  grid.size = {size.x, size.y, size.z};
  grid.density.resize(layer * size.z);
  grid.temperature.resize(grid.density.size());
  grid.velocity.resize(grid.density.size());
  parameters.particles = static_cast<std::uint32_t>(count);
  set_scales(greatest(positions, velocities, masses), parameters);

  // Each task owns a slab of layers and takes from every particle what falls into it: no two tasks
  // write the same cell. A kernel's weights are the same in both slabs that it straddles.
  const auto slabs = static_cast<std::size_t>((size.z + kSlab - 1) / kSlab);
  struct Reach {
    float radius;
    int first, last;  // slabs
  };
  thread_local std::vector<Reach> reaches;
  thread_local std::vector<std::uint32_t> list;
  reaches.resize(count);
  parallel_for_each_index(count, kChunk, [&, reach = reaches.data()](std::size_t i) {
    const float square = parameters.first_square + parameters.growth * velocities[i].w;
    const float radius = std::clamp(std::min(std::sqrt(square), parameters.widest) * inverse_voxel,
                                    1.0f, 0.5f * kWidestSplat - 1);
    // One cell more, since a kernel at the border always keeps its nearest cell.
    const float at = std::clamp(positions[i].z * inverse_voxel, -1.0f, size.z + 1.0f);
    const auto slab = [&](float z) {
      return std::clamp(static_cast<int>(z), 0, size.z - 1) / kSlab;
    };
    reach[i] = {radius, slab(at - radius - 1.0f), slab(at + radius + 1.0f)};
  });
  std::vector<std::size_t> begin(slabs + 1, 0);
  for (const Reach& reach : reaches)
    for (int s = reach.first; s <= reach.last; ++s) ++begin[s + 1];
  for (std::size_t s = 0; s < slabs; ++s) begin[s + 1] += begin[s];
  list.resize(begin.back());
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < count; ++i)
    for (int s = reaches[i].first; s <= reaches[i].last; ++s)
      list[next[s]++] = static_cast<std::uint32_t>(i);

  const double cell_volume = std::pow(1.0 / inverse_voxel, 3);
  const double density_step = 1.0 / (parameters.mass_scale * cell_volume);
  const double heat_step = static_cast<double>(parameters.mass_scale) / parameters.heat_scale;
  const double momentum_step =
      static_cast<double>(parameters.mass_scale) / parameters.momentum_scale;
  parallel_for_each_index(
      slabs, 1, [&, reach = reaches.data(), order = list.data()](std::size_t s) {
        const int low = static_cast<int>(s) * kSlab;
        const int high = std::min(low + kSlab, size.z);
        const std::size_t first_cell = layer * low, cells = layer * (high - low);
        if (begin[s] == begin[s + 1]) {
          std::fill_n(grid.density.begin() + first_cell, cells, 0.0f);
          std::fill_n(grid.temperature.begin() + first_cell, cells, 0.0f);
          std::fill_n(grid.velocity.begin() + first_cell, cells, Vec3f::Zero());
          return;
        }
        // Kept by the thread: fresh pages for every slab would cost more than the splat.
        thread_local std::vector<std::int64_t> sums;
        Slab slab;
        slab.row = static_cast<std::size_t>(size.x) + kLanes;
        slab.layer = slab.row * size.y;
        slab.channel = slab.layer * (high - low);
        sums.assign(kChannels * slab.channel, 0);
        slab.sums = sums.data();
        for (std::size_t n = begin[s]; n < begin[s + 1]; ++n) {
          const std::size_t i = order[n];
          const Float4 &at = positions[i], &v = velocities[i];
          const Tent z(at.z * inverse_voxel, reach[i].radius, size.z);
          const int z_begin = std::max(z.first, low), z_end = std::min(z.first + z.count, high);
          if (z_begin >= z_end) continue;
          const Tent x(at.x * inverse_voxel, reach[i].radius, size.x);
          const Tent y(at.y * inverse_voxel, reach[i].radius, size.y);
          const float heat = masses[i] * at.w * parameters.heat_scale;
          const float momentum = masses[i] * parameters.momentum_scale;
          const std::array<float, kChannels> amounts = {masses[i] * parameters.mass_scale, heat,
                                                        momentum * v.x, momentum * v.y,
                                                        momentum * v.z};
          add_particle(slab, x, y, z, low, z_begin, z_end, amounts.data());
        }
        std::size_t cell = first_cell;
        for (int z = 0; z < high - low; ++z) {
          for (int y = 0; y < size.y; ++y) {
            const std::int64_t* row = slab.sums + z * slab.layer + y * slab.row;
            for (int x = 0; x < size.x; ++x, ++cell) {
              const auto mass = static_cast<double>(row[x]);
              const double inverse = row[x] > 0 ? 1.0 / mass : 0.0;
              const auto mean = [&](int channel, double step) {
                return static_cast<float>(static_cast<double>(row[channel * slab.channel + x]) *
                                          step * inverse);
              };
              grid.density[cell] = static_cast<float>(mass * density_step);
              grid.temperature[cell] = mean(1, heat_step);
              grid.velocity[cell] = {mean(2, momentum_step), mean(3, momentum_step),
                                     mean(4, momentum_step)};
            }
          }
        }
      });
}

SmokeGrid filled_part(const SmokeGrid& grid) {
  const Eigen::Vector3i& size = grid.size;
  Eigen::AlignedBox3i filled;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      const float* row = grid.density.data() + static_cast<std::size_t>(size.x()) *
                                                   (y + static_cast<std::size_t>(size.y()) * z);
      int low = 0, high = size.x() - 1;
      while (low <= high && !(row[low] > 0.0f)) ++low;
      if (low > high) continue;
      while (!(row[high] > 0.0f)) --high;
      filled.extend(Eigen::Vector3i(low, y, z)).extend(Eigen::Vector3i(high, y, z));
    }
  }
  if (filled.isEmpty()) filled.extend(Eigen::Vector3i::Zero());

  SmokeGrid part;
  part.first = grid.first + filled.min();
  part.size = filled.sizes() + Eigen::Vector3i::Ones();
  part.voxel = grid.voxel;
  const Vec3 corner = grid.domain.min() + grid.voxel * filled.min().cast<double>();
  part.domain = Box(corner, corner + grid.voxel * part.size.cast<double>());
  const auto copy = [&](const auto& from, auto& to) {
    to.reserve(static_cast<std::size_t>(part.size.prod()));
    for (int z = filled.min().z(); z <= filled.max().z(); ++z)
      for (int y = filled.min().y(); y <= filled.max().y(); ++y) {
        const auto row =
            from.begin() + filled.min().x() +
            static_cast<std::ptrdiff_t>(size.x()) * (y + static_cast<std::ptrdiff_t>(size.y()) * z);
        to.insert(to.end(), row, row + part.size.x());
      }
  };
  copy(grid.density, part.density);
  copy(grid.temperature, part.temperature);
  copy(grid.velocity, part.velocity);
  return part;
}

}  // namespace viscera
