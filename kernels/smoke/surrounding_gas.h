// The gas that surrounds the parcels of smoke, as the particles see it.
#pragma once

#include <algorithm>
#include <span>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// Places are in the domain's frame [m].
class SurroundingGas {
 public:
  virtual ~SurroundingGas() = default;

  /// u [m/s]; w: how fast eddies are there that u doesn't show, the deviation of each component of
  /// their velocity [m/s]                                                          (n)
  virtual void velocity(std::span<const Float4> positions, std::span<Float4> velocities) = 0;
  /// Temperature over the gas at rest [K]                                          (n)
  virtual void excess(std::span<const Float4> positions, std::span<float> kelvin) = 0;
};

/// Gas that nothing moves or warms.
class RestingGas final : public SurroundingGas {
 public:
  void velocity(std::span<const Float4>, std::span<Float4> velocities) override {
    std::ranges::fill(velocities, Float4());
  }
  void excess(std::span<const Float4>, std::span<float> kelvin) override {
    std::ranges::fill(kelvin, 0.0f);
  }
};

}  // namespace viscera
