#include "kernels/smoke/fog.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/smoke/droplet_optics.h"

namespace viscera {
namespace {

constexpr double kLeastLoad = 1e-7, kMostLoad = 1.0;  // [kg/m3]
constexpr int kEachDecade = 8, kEntries = 7 * kEachDecade + 1;
/// Of sizes about the one that the load gives: smooths the ripples of a single size. Chosen by eye.
constexpr double kSpread = 1.2;
constexpr double kRefraction = 1.333;  // of water in the visible, recalled
constexpr double kLeastSeen = 1e-3;    // [1/m]

}  // namespace

FogOptics::FogOptics(const GasMixture& mixture, double wavelength) : table_(kEntries) {
  parallel_for_each_index(table_.size(), 4, [&](std::size_t i) {
    const double load = kLeastLoad * std::pow(10.0, static_cast<double>(i) / kEachDecade);
    const SmokeOptics one = optics_of({.median = mixture.droplet_diameter(load),
                                       .deviation = kSpread,
                                       .density = gas::kWaterDensity,
                                       .refraction = kRefraction,
                                       .absorption = 0.0},
                                      wavelength);
    table_[i] = {one.mass_extinction * load, one.asymmetry};
  });
}

double FogOptics::place(double load) const {
  return std::clamp(kEachDecade * std::log10(load / kLeastLoad), 0.0, kEntries - 1.0);
}

double FogOptics::extinction(double load) const {
  if (!(load > 0.0)) return 0.0;
  // Less than the table's first are droplets of its size, but fewer.
  if (load <= kLeastLoad) return table_.front().extinction * load / kLeastLoad;
  const double at = place(std::min(load, kMostLoad));
  const auto low = std::min<std::size_t>(static_cast<std::size_t>(at), kEntries - 2);
  const double part = at - static_cast<double>(low);
  return std::pow(table_[low].extinction, 1.0 - part) * std::pow(table_[low + 1].extinction, part);
}

double FogOptics::asymmetry(double load) const {
  if (!(load > 0.0)) return table_.front().asymmetry;
  const double at = place(load);
  const auto low = std::min<std::size_t>(static_cast<std::size_t>(at), kEntries - 2);
  const double part = at - static_cast<double>(low);
  return (1.0 - part) * table_[low].asymmetry + part * table_[low + 1].asymmetry;
}

SmokeGrid fog_of(const GasGrid& gas, const FogOptics& optics, double mass_extinction,
                 double& asymmetry) {
  SmokeGrid fog;
  asymmetry = optics.asymmetry(0.0);
  if (!gas.state().contents.has(kGasDroplets)) return fog;
  const auto& n = gas.cells();
  std::array<int, 3> low = n, high{-1, -1, -1};
  double taken = 0.0, forward = 0.0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double load = gas.content(i, j, k).droplets;
        const double extinction = optics.extinction(load);
        if (!(extinction > kLeastSeen)) continue;
        const std::array<int, 3> at{i, j, k};
        for (int axis = 0; axis < 3; ++axis) {
          low[axis] = std::min(low[axis], at[axis]);
          high[axis] = std::max(high[axis], at[axis]);
        }
        taken += extinction;
        forward += extinction * optics.asymmetry(load);
      }
  if (high[0] < 0) return fog;
  asymmetry = forward / taken;
  // A cell of nothing about it within the gas, so that it ends softly; cubes, as smoke has them.
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::max(0, low[axis] - 1);
    high[axis] = std::min(n[axis] - 1, high[axis] + 1);
  }
  const Vec3 first = gas.cell_middle(low[0], low[1], low[2]);
  const Vec3 last = gas.cell_middle(high[0], high[1], high[2]);
  fog.voxel = gas.spacing().minCoeff();
  fog.size = ((last - first) / fog.voxel).array().ceil().cast<int>() + 1;
  const Vec3 corner = first - Vec3::Constant(0.5 * fog.voxel);
  fog.domain = Box(corner, corner + fog.voxel * fog.size.cast<double>());
  fog.density.resize(static_cast<std::size_t>(fog.size.prod()));
  std::size_t at = 0;
  for (int z = 0; z < fog.size.z(); ++z)
    for (int y = 0; y < fog.size.y(); ++y)
      for (int x = 0; x < fog.size.x(); ++x)
        fog.density[at++] = static_cast<float>(
            optics.extinction(gas.droplets(first + fog.voxel * Vec3(x, y, z))) / mass_extinction);
  return fog;
}

}  // namespace viscera
