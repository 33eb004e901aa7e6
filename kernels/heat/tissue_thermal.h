// What tissue is to heat and to current, and how that changes as it warms and dries.
#pragma once

#include <algorithm>

#include "kernels/base/result.h"

namespace viscera {

inline constexpr double kGasConstant = 8.314462618;  ///< [J/(mol K)]
inline constexpr double kZeroCelsius = 273.15;       ///< [K]

/// A first-order process whose rate is frequency exp(-energy / (R T)).
struct ArrheniusLaw {
  double frequency = 0.0;  ///< A [1/s]
  double energy = 0.0;     ///< Ea [J/mol]

  double rate(double kelvin) const;  ///< [1/s]
};

/// Marks as in assets/tissues.json: [V] read in a source, [R] recalled. The values that stand here
/// are those of liver.
struct ThermalTissue {
  double density = 1079.0;               ///< [kg/m3]                                         [R]
  double specific_heat = 3540.0;         ///< of wet tissue [J/(kg K)]                        [R]
  double conductivity = 0.52;            ///< of wet tissue at body temperature [W/(m K)]     [R]
  double perfusion = 0.01547;            ///< blood through a volume of tissue [1/s]          [R]
  double metabolic_heat = 1.2e4;         ///< at body temperature [W/m3]                      [R]
  double water_fraction = 0.72;          ///< by mass                                         [R]
  double electric_conductivity = 0.148;  ///< at body temperature [S/m]                       [V]
  /// Of the proteins, which blanches and stiffens: half of liver's whitening, from its enthalpy
  /// 2.768e5 J/mol and entropy 553.5 J/(mol K) by k T / h exp(entropy / R) at 52 C
  /// [Jacques2006]. [V]
  ArrheniusLaw coagulation{5.53e41, 2.768e5};
  /// Share of what vaporises that is seen as smoke: particles, the rest being clear vapour. Of
  /// surgical smoke as reviews have it; no source gave a mass rate. [R]
  double smoke_yield = 0.05;

  // How values change. All [R].
  double conductivity_slope = 1.2e-3;  ///< of heat, up to boiling [1/K]
  double dry_conductivity = 0.15;      ///< of heat, without water [W/(m K)]
  double electric_slope = 0.018;       ///< up to `electric_peak` [1/K]
  double electric_peak = 358.15;       ///< where it stops rising [K]
  double dry_electric_share = 0.01;    ///< of electric conductivity that is left without water
  double metabolic_slope = 0.1;        ///< rise of metabolic heat [1/K]

  /// How fast collagen shrinks: ln A and Ea / R are 152.35 and 53,256 K, of tendon [Chen1998]. [R]
  ArrheniusLaw collagen{1.4614e66, 4.42795e5};

  // What happens to the solids once the water has gone: char in about a second at 250 C. All [R].
  ArrheniusLaw pyrolysis{6.8e10, 1.1e5};
  double char_share = 0.25;       ///< of the solids' mass that stays as char
  double pyrolysis_heat = 1.0e6;  ///< per mass that leaves [J/kg]
};

/// Water and blood, the same in every tissue.
namespace water {
inline constexpr double kSpecificHeat = 4180.0;  ///< [J/(kg K)]
inline constexpr double kLatentHeat = 2.26e6;    ///< at 100 C [J/kg]
inline constexpr double kBoiling = 373.15;       ///< [K]
inline constexpr double kBloodDensity = 1050.0;  ///< [kg/m3]
inline constexpr double kBloodHeat = 3617.0;     ///< [J/(kg K)]
/// Of the logarithm of saturated vapour's pressure against 1/T [K].
inline constexpr double kVapourSlope = 5130.0;
/// Saturated vapour over water at `kelvin` [kg/m3]: Clausius-Clapeyron's line through 100 C, its
/// slope fitted between 37 and 100 C. Beyond boiling it stays.
double vapour_density(double kelvin);
}  // namespace water

/// Perfusion in the unit of tables, mL/(min kg), as volume per volume and second.
constexpr double perfusion_rate(double ml_per_min_kg, double density) {
  return ml_per_min_kg * density * 1e-6 / 60.0;
}

/// Of the solids alone [J/(kg K)]: what water leaves of the wet tissue's.
double solids_specific_heat(const ThermalTissue& tissue);

/// Heat capacity of a volume that has `water` (1 wet ... 0 dry) of its water and of whose solids
/// the share `charred` has been through pyrolysis [J/(m3 K)]. Water's and blood's own change by
/// less than 1 % between 37 and 100 C, so temperature doesn't enter.
double heat_capacity(const ThermalTissue& tissue, double water, double charred = 0.0);

/// Share of wet tissue's mass that such a volume has kept: neither boiled off nor gone as fumes.
double mass_left(const ThermalTissue& tissue, double water, double charred);

/// [W/(m K)] at `excess` over body temperature [K].
double heat_conductivity(const ThermalTissue& tissue, double water, double excess, double body);

/// [S/m] at temperature `kelvin`: rises with it, and falls with the square of the water that is
/// left, as the brine in a porous solid's does [Archie1942].
double electric_conductivity(const ThermalTissue& tissue, double water, double kelvin);

/// Every value that can't be, by its name: what was found, what was expected.
Result<void> check(const ThermalTissue& tissue);

}  // namespace viscera
