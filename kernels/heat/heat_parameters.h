// What the passes of heat and their GLSL twins both know of an organ: numbers, and what both decide
// by. A twin header (engine/gpu/twin_header.h).
#pragma once

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
  float unused = 0.0f;    ///< a struct in a block fills whole vectors
};

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
  /// Heat that vapour takes from a wet surface, by its density [W m/kg]; 0: none.
  float evaporation;
  float resting_vapour;  ///< over water at body temperature [kg/m3]
  float vapour_slope;    ///< water::kVapourSlope [K]
  float unused_a = 0.0f, unused_b = 0.0f;
};

}  // namespace viscera
