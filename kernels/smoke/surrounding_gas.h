// The gas that surrounds the parcels of smoke, as the particles see it.
#pragma once

#include <algorithm>
#include <span>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// What moves the gas where no particles are. In each substep of dt, in this order: `velocity`,
/// `couple` with the rates that drag would have, `add_momentum`, all for the positions that the
/// first was given, in the domain's frame [m]: what a parcel gives goes to the gas that it was
/// reckoned with. w of every Float4 is left alone.
class SurroundingGas {
 public:
  virtual ~SurroundingGas() = default;

  /// u at the positions [m/s]                                                       (n)
  virtual void velocity(std::span<const Float4> positions, std::span<Float4> velocities) = 0;
  /// theta within (0, 1]: what scales the rate of drag so that the gas, which takes m k dt (v' - u)
  /// from each, doesn't overshoot the parcels' velocity. `exchanged` is m k dt [kg].
  virtual void couple(std::span<const float> exchanged, std::span<float> theta) = 0;
  /// Momentum that the parcels gave to the gas [kg m/s].
  virtual void add_momentum(std::span<const Float4> impulses) = 0;
};

/// Gas at rest of any mass: it takes momentum and doesn't move.
class RestingGas final : public SurroundingGas {
 public:
  void velocity(std::span<const Float4>, std::span<Float4> velocities) override {
    std::ranges::fill(velocities, Float4());
  }
  void couple(std::span<const float>, std::span<float> theta) override {
    std::ranges::fill(theta, 1.0f);
  }
  void add_momentum(std::span<const Float4> impulses) override {
    for (const Float4& impulse : impulses) momentum_ += impulse.xyz().cast<double>();
  }
  const Vec3& momentum() const { return momentum_; }  ///< taken so far [kg m/s]

 private:
  Vec3 momentum_ = Vec3::Zero();
};

}  // namespace viscera
