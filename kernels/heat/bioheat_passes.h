// The passes of a step of heat, a brick each. Bricks of one pass can be worked on in any order and
// at once: a pass writes to its own brick, and reads of its neighbours only what this pass doesn't
// write.
#pragma once

#include "kernels/heat/heat_bricks.h"
#include "kernels/heat/super_steps.h"
#include "kernels/heat/tissue_thermal.h"

namespace viscera {

/// What all voxels of an organ share.
struct BioheatNumbers {
  float dry_conductivity, wet_conductivity, conductivity_slope;  ///< [W/(m K)], [W/(m K)], [1/K]
  float boiling;                          ///< excess at which water boils [K]
  float solids_capacity, water_capacity;  ///< of wet tissue's solids and of its water [J/(m3 K)]
  float lost_solids;                      ///< share of the solids that leaves as they char
  float drain;            ///< of living tissue: perfusion less metabolism [W/(m3 K)]
  float inverse_square;   ///< of the voxel's edge [1/m2]
  float damage_exponent;  ///< ln A, A in 1/s
  float damage_kelvin;    ///< Ea / R [K]
  float resting_rate;     ///< of damage at body temperature, which tissue repairs [1/s]
  float body;             ///< temperature [K]
  float voxel;            ///< its edge [m]
  float followed;         ///< excess beyond which heat leaves a side without a brick [K]
};
static_assert(sizeof(BioheatNumbers) == 15 * sizeof(float));

// What both twins decide by.
inline constexpr float kAtBoiling = 0.99999f;   ///< of boiling's excess: where fronts of drying are
inline constexpr float kMostDamage = 1e3f;      ///< exp(-1000) is nothing
inline constexpr float kDamageFelt = 2.0f;      ///< excess below which damage isn't counted [K]
inline constexpr float kHarmedDamage = 1e-3f;   ///< Omega that is kept
inline constexpr double kDriedWater = 0.999;    ///< below it the loss is kept
inline constexpr double kLeastWater = 1e-6;     ///< less is none
inline constexpr double kLeastCharring = 1e-9;  ///< share of the solids in a step
inline constexpr float kFeltAtSurface = 1e-3f;  ///< excess below which surfaces don't cool [K]
/// Drying goes at one rate while water still comes up to the surface, and falls with what is left
/// then. [R]
inline constexpr float kWetSurface = 0.25f;

/// What surfaces do to heat.
struct SurfaceCooling {
  double coefficient = 15.0;  ///< to still insufflation gas, 10 to 25 [W/(m2 K)]               [R]
  bool evaporates = true;     ///< wet tissue gives vapour to dry gas
  /// Of gas per volume [J/(m3 K)]: that of carbon dioxide at 12 mmHg over the atmosphere. Vapour
  /// leaves as heat does (Lewis): by coefficient / gas_capacity [m/s]. [R]
  double gas_capacity = 1500.0;
};

/// All numbers of an organ, as the GPU has them. The CPU settles in double precision, from tissue
/// and cooling themselves.
struct HeatParameters {
  BioheatNumbers numbers;
  float latent_heat;         ///< of water [J/kg]
  float water_mass;          ///< in wet tissue [kg/m3]
  float fumes_mass;          ///< that its solids lose as they char [kg/m3]
  float pyrolysis_exponent;  ///< ln A, A in 1/s
  float pyrolysis_kelvin;    ///< Ea / R [K]
  float pyrolysis_heat;      ///< per mass that leaves [J/kg]
  float cooling;             ///< of surfaces, to the gas [W/(m2 K)]
  float
      evaporation;  ///< heat that vapour takes from a wet surface, by its density [W m/kg]; 0: none
  float resting_vapour;  ///< over water at body temperature [kg/m3]
  float vapour_slope;    ///< water::kVapourSlope [K]
};
static_assert(sizeof(HeatParameters) == 25 * sizeof(float));
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
