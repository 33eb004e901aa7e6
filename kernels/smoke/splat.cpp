#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>

#include "kernels/base/parallel.h"
#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

constexpr int kSlab = 4;           // layers of cells that one task fills
constexpr int kWidest = 64;        // cells across a kernel
constexpr double kSteps = 0x1p44;  // fixed-point steps in the total: sums stay below 2^63

// The weights of a tent along one axis, on cells inside the grid, with the sum 1.
struct Tent {
  int first = 0, count = 0;
  std::array<float, kWidest> weights;

  // `at` and `radius` in cells, cell i spans [i, i + 1).
  Tent(float at, float radius, int size) {
    first = std::clamp(static_cast<int>(std::floor(at - radius + 0.5f)), 0, size - 1);
    const int last = std::clamp(static_cast<int>(std::floor(at + radius - 0.5f)), first, size - 1);
    count = std::min(last - first + 1, kWidest);
    float sum = 0.0f;
    for (int i = 0; i < count; ++i) {
      const float distance = std::abs(static_cast<float>(first + i) + 0.5f - at);
      weights[i] = std::max(0.0f, 1.0f - distance / radius);
      sum += weights[i];
    }
    if (sum <= 0.0f) {
      count = 1;
      sum = weights[0] = 1.0f;
    }
    for (int i = 0; i < count; ++i) weights[i] /= sum;
  }
};

float kernel_radius(const SmokeParameters& parameters, float age) {
  const double h = parameters.spacing;
  const double grown = 0.25 * h * h + 12.0 * effective_viscosity(parameters) * age;
  return static_cast<float>(std::min(std::sqrt(grown), 2.5 * h));
}

}  // namespace

void splat(const SmokeVolume& smoke, double voxel, SmokeGrid& grid) {
  assert(voxel > 0.0);
  const SmokeParameters& parameters = smoke.parameters();
  const SmokeParticles& particles = smoke.particles();
  const std::size_t count = particles.size();
  // A hundredth of a cell less, so that a domain of whole cells doesn't gain one by rounding.
  const Vec3 cells = (parameters.domain.sizes() / voxel).array() - 0.01;
  grid.size = cells.array().ceil().max(1.0).cast<int>();
  grid.voxel = voxel;
  grid.domain =
      Box(parameters.domain.min(), parameters.domain.min() + voxel * grid.size.cast<double>());
  const std::size_t layer = static_cast<std::size_t>(grid.size.x()) * grid.size.y();
  grid.density.resize(layer * grid.size.z());
  grid.temperature.resize(grid.density.size());

  double mass = 0.0, heat = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    mass += particles.masses[i];
    heat += std::abs(static_cast<double>(particles.masses[i]) * particles.temperatures[i]);
  }
  const double mass_step = mass > 0.0 ? mass / kSteps : 1.0;
  const double heat_step = heat > 0.0 ? heat / kSteps : 1.0;
  const double density_step = mass_step / (voxel * voxel * voxel);
  const float inverse_voxel = static_cast<float>(1.0 / voxel);

  // Each task owns a slab of layers and takes from every particle what falls into it: no two tasks
  // write the same cell. A kernel's weights are the same in both slabs that it straddles.
  struct Cell {
    std::int64_t mass, heat;
  };
  const auto slabs = static_cast<std::size_t>((grid.size.z() + kSlab - 1) / kSlab);
  std::vector<float> radii(count);
  parallel_for_each_index(count, 1024, [&](std::size_t i) {
    radii[i] = std::clamp(kernel_radius(parameters, particles.ages[i]) * inverse_voxel, 1.0f,
                          0.5f * kWidest - 1.0f);
  });
  parallel_for_each_index(slabs, 1, [&](std::size_t slab) {
    const int low = static_cast<int>(slab) * kSlab;
    const int high = std::min(low + kSlab, grid.size.z());
    // Kept by the thread: fresh pages for every slab would cost more than the splat.
    thread_local std::vector<Cell> sums;
    sums.assign(layer * (high - low), Cell{0, 0});
    bool touched = false;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f at = particles.positions[i] * inverse_voxel;
      // One cell more, since a kernel at the border always keeps its nearest cell.
      if (at.z() + radii[i] + 1.0f < low || at.z() - radii[i] - 1.0f > high) continue;
      const Tent z(at.z(), radii[i], grid.size.z());
      const int z_begin = std::max(z.first, low);
      const int z_end = std::min(z.first + z.count, high);
      if (z_begin >= z_end) continue;
      touched = true;
      const Tent x(at.x(), radii[i], grid.size.x());
      const Tent y(at.y(), radii[i], grid.size.y());
      const double mass_scale = particles.masses[i] / mass_step;
      const double heat_scale =
          static_cast<double>(particles.masses[i]) * particles.temperatures[i] / heat_step;
      for (int cz = z_begin; cz < z_end; ++cz) {
        for (int cy = 0; cy < y.count; ++cy) {
          const float row_weight = z.weights[cz - z.first] * y.weights[cy];
          Cell* row = sums.data() + layer * (cz - low) +
                      static_cast<std::size_t>(grid.size.x()) * (y.first + cy) + x.first;
          for (int cx = 0; cx < x.count; ++cx) {
            const double weight = row_weight * x.weights[cx];
            row[cx].mass += static_cast<std::int64_t>(weight * mass_scale + 0.5);
            row[cx].heat += static_cast<std::int64_t>(weight * heat_scale);
          }
        }
      }
    }
    float* density = grid.density.data() + layer * low;
    float* temperature = grid.temperature.data() + layer * low;
    if (!touched) {
      std::fill_n(density, sums.size(), 0.0f);
      std::fill_n(temperature, sums.size(), 0.0f);
      return;
    }
    for (std::size_t c = 0; c < sums.size(); ++c) {
      const auto cell_mass = static_cast<double>(sums[c].mass);
      density[c] = static_cast<float>(cell_mass * density_step);
      temperature[c] = sums[c].mass > 0
                           ? static_cast<float>(sums[c].heat * heat_step / (cell_mass * mass_step))
                           : 0.0f;
    }
  });
}

}  // namespace viscera
