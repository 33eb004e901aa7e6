#include "kernels/heat/tissue_thermal.h"

#include <cmath>
#include <string>

namespace viscera {
namespace {

constexpr double kVapourConstant = 461.5;  // [J/(kg K)]
constexpr double kAtmosphere = 101325.0;   // [Pa]

}  // namespace

double ArrheniusLaw::rate(double kelvin) const {
  return frequency * std::exp(-energy / (kGasConstant * kelvin));
}

double water::vapour_density(double kelvin) {
  const double at = std::min(kelvin, kBoiling);
  const double pressure = kAtmosphere * std::exp(-kVapourSlope * (1.0 / at - 1.0 / kBoiling));
  return pressure / (kVapourConstant * at);
}

double solids_specific_heat(const ThermalTissue& tissue) {
  return (tissue.specific_heat - tissue.water_fraction * water::kSpecificHeat) /
         (1.0 - tissue.water_fraction);
}

double heat_capacity(const ThermalTissue& tissue, double water, double charred) {
  const double solids = (1.0 - tissue.water_fraction) * (1.0 - (1.0 - tissue.char_share) * charred);
  return tissue.density * (solids * solids_specific_heat(tissue) +
                           tissue.water_fraction * water * water::kSpecificHeat);
}

double mass_left(const ThermalTissue& tissue, double water, double charred) {
  const double solids = 1.0 - (1.0 - tissue.char_share) * charred;
  return tissue.water_fraction * water + (1.0 - tissue.water_fraction) * solids;
}

double heat_conductivity(const ThermalTissue& tissue, double water, double excess, double body) {
  const double warm = std::clamp(excess, 0.0, water::kBoiling - body);
  return (tissue.dry_conductivity + (tissue.conductivity - tissue.dry_conductivity) * water) *
         (1.0 + tissue.conductivity_slope * warm);
}

double electric_conductivity(const ThermalTissue& tissue, double water, double kelvin) {
  constexpr double kBody = kZeroCelsius + 37.0;
  const double warm = std::max(0.0, std::min(kelvin, tissue.electric_peak) - kBody);
  const double wet = tissue.dry_electric_share + (1.0 - tissue.dry_electric_share) * water * water;
  return tissue.electric_conductivity * (1.0 + tissue.electric_slope * warm) * wet;
}

Result<void> check(const ThermalTissue& tissue) {
  Error error;
  // Not-a-number fails every comparison, so it is refused too.
  const auto expect = [&](bool holds, const char* name, const std::string& expected, double found) {
    if (!holds)
      error.messages.push_back(std::string(name) + ": expected " + expected + ", found " +
                               std::to_string(found));
  };
  const auto within = [&](const char* name, double value, double low, double high) {
    expect(value >= low && value <= high, name, std::to_string(low) + " to " + std::to_string(high),
           value);
  };
  within("density [kg/m3]", tissue.density, 1.0, 5000.0);
  within("specific_heat [J/(kg K)]", tissue.specific_heat, 100.0, 10000.0);
  within("thermal_conductivity [W/(m K)]", tissue.conductivity, 1e-3, 10.0);
  within("dry thermal conductivity [W/(m K)]", tissue.dry_conductivity, 1e-3, 10.0);
  within("perfusion [1/s]", tissue.perfusion, 0.0, 1.0);
  within("metabolic heat [W/m3]", tissue.metabolic_heat, 0.0, 1e6);
  within("water_fraction", tissue.water_fraction, 0.0, 0.99);
  within("electrical_conductivity [S/m]", tissue.electric_conductivity, 1e-6, 10.0);
  within("coagulation_frequency [1/s]", tissue.coagulation.frequency, 0.0, 1e120);
  within("coagulation_energy [J/mol]", tissue.coagulation.energy, 0.0, 1e7);
  within("frequency of collagen [1/s]", tissue.collagen.frequency, 0.0, 1e120);
  within("energy of collagen [J/mol]", tissue.collagen.energy, 0.0, 1e7);
  within("smoke yield", tissue.smoke_yield, 0.0, 1.0);
  within("share of char", tissue.char_share, 0.01, 1.0);
  if (error.messages.empty()) {
    const double solids = solids_specific_heat(tissue);
    expect(solids >= 100.0, "specific_heat [J/(kg K)]",
           "more than its water's share, " +
               std::to_string(tissue.water_fraction * water::kSpecificHeat),
           tissue.specific_heat);
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

}  // namespace viscera
