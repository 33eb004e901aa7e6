// The passes of a step of heat, a brick each. Bricks of one pass can be worked on in any order and at
// once: a pass writes to its own brick, and reads of its neighbours only what this pass doesn't write.
#pragma once

#include "kernels/heat/heat_bricks.h"
#include "kernels/heat/super_steps.h"
#include "kernels/heat/tissue_thermal.h"

namespace viscera {

/// What all voxels of an organ share.
struct BioheatNumbers {
  float dry_conductivity, wet_conductivity, conductivity_slope;  ///< [W/(m K)], [W/(m K)], [1/K]
  float boiling;                         ///< excess at which water boils [K]
  float solids_capacity, water_capacity; ///< of wet tissue's solids and of its water [J/(m3 K)]
  float lost_solids;                     ///< share of the solids that leaves as they char
  float drain;                           ///< of living tissue: perfusion less metabolism [W/(m3 K)]
  float inverse_square;                  ///< of the voxel's edge [1/m2]
  float damage_exponent;                 ///< ln A, A in 1/s
  float damage_kelvin;                   ///< Ea / R [K]
  float resting_rate;                    ///< of damage at body temperature, which tissue repairs [1/s]
  float body;                            ///< temperature [K]
  float voxel;                           ///< its edge [m]
  float followed;                        ///< excess beyond which heat leaves a side without a brick [K]
};
static_assert(sizeof(BioheatNumbers) == 15 * sizeof(float));

/// What surfaces do to heat.
struct SurfaceCooling {
  double coefficient = 15.0;  ///< to still insufflation gas, 10 to 25 [W/(m2 K)]               [R]
  bool evaporates = true;     ///< wet tissue gives vapour to dry gas
  /// Of gas per volume [J/(m3 K)]: that of carbon dioxide at 12 mmHg over the atmosphere. Vapour leaves as
  /// heat does (Lewis): by coefficient / gas_capacity [m/s].                                     [R]
  double gas_capacity = 1500.0;
};

/// Conductivity, capacity and living share from the state; clears the brick's sums.
void prepare_brick(HeatBrick& brick, const BioheatNumbers& numbers);

/// rate = (div k grad T + source - drain) / capacity, from this brick's excess and its neighbours'. Where
/// no warm brick is, nothing flows; unless the side is so warm that there should be one, and there was no
/// room: then the tissue beyond is taken as cold.
void find_rates(HeatBrick& brick, const BioheatNumbers& numbers);

/// excess += dt rate.
void advance_brick(HeatBrick& brick, float dt);
/// Stage j of a super step over dt: from find_rates' rate to the next excess.
void advance_stage(HeatBrick& brick, const SuperStage& stage, int j, float dt);

/// What a step does beyond conduction: cooling at the surface, boiling, charring, damage; then the brick's
/// greatest temperature and those along its sides.
void settle_brick(HeatBrick& brick, const BioheatNumbers& numbers, const ThermalTissue& tissue,
                  const SurfaceCooling& cooling, double dt);

/// Heat that a brick holds [J].
double stored_in(const HeatBrick& brick, const BioheatNumbers& numbers);

}  // namespace viscera
