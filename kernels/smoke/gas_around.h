// The gas grid as the particles of one smoke volume see it.
#pragma once

#include <vector>

#include "kernels/smoke/gas_grid.h"
#include "kernels/smoke/surrounding_gas.h"

namespace viscera {

class GasAround final : public SurroundingGas {
 public:
  /// `origin`: of the volume's positions, world [m].
  GasAround(GasGrid& grid, const Vec3& origin) : grid_(grid), origin_(origin) {}

  void velocity(std::span<const Float4> positions, std::span<Float4> velocities) override;
  void excess(std::span<const Float4> positions, std::span<float> kelvin) override;

 private:
  GasGrid& grid_;
  Vec3 origin_;
  std::vector<float> eddies_;
};

}  // namespace viscera
