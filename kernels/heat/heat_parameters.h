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
  float drain;                 ///< of living tissue: perfusion less metabolism [W/(m3 K)]
  float inverse_square;        ///< of the voxel's edge [1/m2]
  float coagulation_exponent;  ///< ln A, A in 1/s
  float coagulation_kelvin;    ///< Ea / R [K]
  float collagen_exponent;     ///< likewise
  float collagen_kelvin;
  float body;      ///< temperature [K]
  float voxel;     ///< its edge [m]
  float followed;  ///< excess beyond which heat leaves a side without a brick [K]
};

// What both twins decide by.
inline constexpr float kAtBoiling = 0.99999f;   ///< of boiling's excess: where fronts of drying are
inline constexpr double kDriedWater = 0.999;    ///< below it the loss is kept
inline constexpr double kLeastWater = 1e-6;     ///< less is none
inline constexpr double kLeastCharring = 1e-9;  ///< share of the solids in a step
inline constexpr float kFeltAtSurface = 1e-3f;  ///< excess below which surfaces don't cool [K]
// How heat harms; what is meant stands in damage.h.
inline constexpr float kDoseCounts = 312.15f;       ///< no dose below, 39 C [K]               [R]
inline constexpr float kDoseKnee = 316.15f;         ///< 43 C [K]
inline constexpr float kDoseSlope = 0.69314718f;    ///< ln 2 a kelvin above the knee          [R]
inline constexpr float kDoseColdSlope = 2.0f;       ///< so many times that below: ln 4        [R]
inline constexpr float kLethalTime = 14400.0f;      ///< at the knee: 240 minutes [s]          [R]
inline constexpr float kCoagulates = 318.0f;        ///< it was measured from 45 C on [K]
inline constexpr float kCollagenShrinks = 323.15f;  ///< 50 C, as the measurements' authors say [K]
/// Beyond it a rate is as good as any [ln 1/s]; and a single step does all there is to do.
inline constexpr float kFastestHarm = 60.0f;
inline constexpr float kMostDose = 1e3f;            ///< of the lethal one
inline constexpr float kMostCoagulation = 1e3f;     ///< exp(-1000) is nothing
inline constexpr float kMostCollagen = 1e9f;        ///< it counts by its logarithm
inline constexpr float kHarmedDose = 1e-2f;         ///< that is kept
inline constexpr float kHarmedCoagulation = 1e-3f;  ///< likewise
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
