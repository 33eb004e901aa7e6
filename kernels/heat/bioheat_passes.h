// The passes of a step of heat, a brick each. Bricks of one pass can be worked on in any order and
// at once: a pass writes to its own brick, and reads of its neighbours only what this pass doesn't
// write.
#pragma once

#include <cmath>

#include "kernels/heat/heat_bricks.h"
#include "kernels/heat/heat_parameters.h"
#include "kernels/heat/super_steps.h"
#include "kernels/heat/tissue_thermal.h"

namespace viscera {

/// What surfaces do to heat.
struct SurfaceCooling {
  double coefficient = 15.0;  ///< to still insufflation gas, 10 to 25 [W/(m2 K)]               [R]
  bool evaporates = true;     ///< wet tissue gives vapour to dry gas
  /// Of gas per volume [J/(m3 K)]: that of carbon dioxide at 12 mmHg over the atmosphere.      [R]
  double gas_capacity = 1500.0;
  /// Diffusivity of heat over that of vapour, in carbon dioxide (0.85 in air): vapour spreads
  /// faster than heat.                                                                          [R]
  double lewis = 0.59;

  /// At which vapour leaves, as heat does through the same boundary layer [Chilton1934] [m/s].
  double vapour_transfer() const {
    return coefficient / (gas_capacity * std::pow(lewis, 2.0 / 3.0));
  }
};

/// The numbers as the GPU has them.
HeatParameters heat_parameters(const BioheatNumbers& numbers, const ThermalTissue& tissue,
                               const SurfaceCooling& cooling);

/// Conductivity, capacity and living share from the state; clears the brick's sums.
void prepare_brick(HeatBrick& brick, const BioheatNumbers& numbers);

/// rate = (div k grad T + source - drain) / capacity, from this brick's excess and its neighbours'.
/// Where no warm brick is, nothing flows; unless the side is so warm that there should be one, and
/// there was no room: then the tissue beyond is taken as cold.
void find_rates(HeatBrick& brick, const BioheatNumbers& numbers);

/// excess += dt rate.
void advance_brick(HeatBrick& brick, float dt);
/// Stage j of a super step over dt: from find_rates' rate to the next excess.
void advance_stage(HeatBrick& brick, const SuperStage& stage, int j, float dt);

/// What a step does beyond conduction: cooling at the surface, boiling, charring, damage; then the
/// brick's greatest temperature and those along its sides.
void settle_brick(HeatBrick& brick, const BioheatNumbers& numbers, const ThermalTissue& tissue,
                  const SurfaceCooling& cooling, double dt);

/// Heat that a brick holds [J].
double stored_in(const HeatBrick& brick, const BioheatNumbers& numbers);

}  // namespace viscera
