#include "kernels/smoke/gas_sources.h"

#include <algorithm>
#include <cmath>

namespace viscera {

GasRegions gas_regions(const GasLayout& layout, std::span<const std::uint8_t> solid,
                       const GasFaces& weights) {
  GasRegions regions;
  regions.of.assign(static_cast<std::size_t>(layout.count), -1);
  std::vector<std::uint8_t> waiting(regions.of.size(), 0);
  layout.rows([&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i) {
      waiting[static_cast<std::size_t>(i)] = solid[static_cast<std::size_t>(i)] == 0;
    }
  });
  std::vector<std::ptrdiff_t> front;
  for (std::ptrdiff_t seed = 0; seed < layout.count; ++seed) {
    if (!waiting[static_cast<std::size_t>(seed)]) continue;
    const int region = static_cast<int>(regions.cells.size());
    regions.cells.push_back(0);
    const auto enter = [&](std::ptrdiff_t c) {
      if (!waiting[static_cast<std::size_t>(c)]) return;
      waiting[static_cast<std::size_t>(c)] = 0;
      regions.of[static_cast<std::size_t>(c)] = region;
      ++regions.cells.back();
      front.push_back(c);
    };
    enter(seed);
    while (!front.empty()) {
      const std::ptrdiff_t c = front.back();
      front.pop_back();
      for (int axis = 0; axis < 3; ++axis) {
        const float* w = weights[axis].data() + c;
        if (w[0] > 0.0f) enter(c - layout.stride[axis]);
        if (w[layout.stride[axis]] > 0.0f) enter(c + layout.stride[axis]);
      }
    }
  }
  return regions;
}

double least_spread(const Vec3& spacing) {
  return 1.5 * spacing.maxCoeff();
}

GasSpread spread_source(const GasLayout& layout, const Vec3& spacing, const GasRegions& regions,
                        const Vec3& place, double radius) {
  for (double reach = std::max(radius, least_spread(spacing)), most = 4.0 * reach; reach <= most;
       reach *= 2.0) {
    GasSpread found;
    int largest = -1;
    std::array<int, 3> first, last;
    for (int axis = 0; axis < 3; ++axis) {
      const auto cell = [&](double at) {
        return static_cast<int>(std::clamp(std::floor(at / spacing[axis]), 0.0,
                                           static_cast<double>(layout.n[axis] - 1)));
      };
      first[axis] = cell(place[axis] - reach);
      last[axis] = cell(place[axis] + reach);
    }
    for (int k = first[2]; k <= last[2]; ++k) {
      for (int j = first[1]; j <= last[1]; ++j) {
        for (int i = first[0]; i <= last[0]; ++i) {
          const std::ptrdiff_t c = layout.index(i, j, k);
          const int region = regions.of[static_cast<std::size_t>(c)];
          const Vec3 middle = (Vec3(i, j, k).array() + 0.5) * spacing.array();
          const double weight = 1.0 - (middle - place).squaredNorm() / (reach * reach);
          if (region < 0 || weight <= 0.0) continue;
          if (largest < 0 || regions.cells[static_cast<std::size_t>(region)] >
                                 regions.cells[static_cast<std::size_t>(largest)]) {
            largest = region;
          }
          found.cells.push_back(c);
          found.weights.push_back(weight);
        }
      }
    }
    GasSpread spread;
    double sum = 0.0;
    for (std::size_t i = 0; i < found.cells.size(); ++i) {
      if (regions.of[static_cast<std::size_t>(found.cells[i])] != largest) continue;
      spread.cells.push_back(found.cells[i]);
      spread.weights.push_back(found.weights[i]);
      sum += found.weights[i];
    }
    for (double& weight : spread.weights) weight /= sum;
    if (!spread.cells.empty()) return spread;
  }
  return {};
}

}  // namespace viscera
