// The gas grid as the particles of one smoke volume see it.
#pragma once

#include "kernels/smoke/gas_grid.h"
#include "kernels/smoke/surrounding_gas.h"

namespace viscera {

class GasAround final : public SurroundingGas {
 public:
  /// `origin`: of the volume's positions, world [m].
  GasAround(GasGrid& grid, const Vec3& origin) : grid_(grid), origin_(origin) {}

  void velocity(std::span<const Float4> positions, std::span<Float4> velocities) override;
  void couple(std::span<const float> exchanged, std::span<float> theta) override;
  void add_momentum(std::span<const Float4> impulses) override;

 private:
  GasGrid& grid_;
  Vec3 origin_;
};

}  // namespace viscera
