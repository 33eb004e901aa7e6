#include "kernels/smoke/gas_mixture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kLeastDroplet = 0.3e-6;  // of smoke's, on which vapour condenses [m]

/// Of saturated vapour over water [Pa]; [Buck1981], within 0.1 % to 50 C and 0.5 % to 100 C.
double saturation_pressure(double kelvin) {
  const double celsius = std::clamp(kelvin - 273.15, -40.0, 130.0);
  return 611.21 * std::exp((18.678 - celsius / 234.5) * (celsius / (257.14 + celsius)));
}

}  // namespace

double GasMixture::excess_of(double heat) const {
  // Gas that is all heat would be infinitely thin: rounding may ask for it.
  const double h = std::clamp(heat / full_heat(), -0.5, 0.95);
  return temperature * h / (1.0 - h);
}

double GasMixture::lack(const GasContent& content) const {
  return density() * content.heat / full_heat() +
         content.vapour * (gas::kMolarMass / gas::kWaterMolarMass - 1.0) +
         content.air * (gas::kMolarMass / gas::kAirMolarMass - 1.0) - content.droplets;
}

double GasMixture::saturation(double kelvin) const {
  return saturation_pressure(kelvin) * gas::kWaterMolarMass / (gas::kGasConstant * kelvin);
}

double GasMixture::droplet_diameter(double load) const {
  const double each = 6.0 * std::max(0.0, load) / (std::numbers::pi * gas::kWaterDensity * nuclei);
  return std::max(kLeastDroplet, std::cbrt(each));
}

double GasMixture::condenses(const GasContent& content, double dt) const {
  const double vapour = std::max(0.0, resting_vapour() + content.vapour);
  const double droplets = std::max(0.0, content.droplets);
  const auto over = [&](double condensed) {
    const double kelvin = temperature + excess_of(content.heat + gas::kLatentHeat * condensed);
    return vapour - condensed - saturation(kelvin);
  };
  const double now = over(0.0);
  if (now <= 0.0 && droplets <= 0.0) return 0.0;
  // Where it would end, by halving: what is over saturation falls as vapour condenses.
  double low = now > 0.0 ? 0.0 : -droplets, high = now > 0.0 ? vapour : 0.0;
  if (now < 0.0 && over(low) <= 0.0) {
    high = low;  // all of it
  } else {
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + high);
      (over(middle) > 0.0 ? low : high) = middle;
    }
  }
  const double end = 0.5 * (low + high);
  // How fast: a droplet's own temperature follows from what it gives off and what is led away.
  const double kelvin = temperature + excess_of(content.heat);
  constexpr double kStep = 0.5;  // [K]
  const double slope = (saturation(kelvin + kStep) - saturation(kelvin - kStep)) / (2.0 * kStep);
  const double hindered = 1.0 + gas::kLatentHeat * slope / (heat_capacity() * lewis());
  const double diameter = droplet_diameter(std::max(droplets, end));
  const double rate = 2.0 * std::numbers::pi * nuclei * diameter * vapour_diffusivity() / hindered;
  // Relaxation of what is over saturation, `now`, to 0 at `end`.
  const double relaxed = end != 0.0 ? rate * now / end : 0.0;
  return end * -std::expm1(-std::max(0.0, relaxed) * dt);
}

GasGift GasGift::steam(const GasMixture& mixture, double mass, double kelvin) {
  const double rest = mass * mixture.volume_of(gas::kWaterMolarMass);
  return {rest * kelvin / mixture.temperature,
          mass / gas::kWaterMolarMass * gas::kMolarHeat * (kelvin - mixture.temperature), mass};
}

GasGift GasGift::fumes(const GasMixture& mixture, double mass, double kelvin) {
  const double rest = mass * mixture.volume_of(gas::kMolarMass);
  return {rest * kelvin / mixture.temperature,
          mass / gas::kMolarMass * gas::kMolarHeat * (kelvin - mixture.temperature), 0.0};
}

GasGift GasGift::warmth(const GasMixture& mixture, double heat) {
  return {heat / mixture.full_heat(), heat, 0.0};
}

GasGift& GasGift::operator+=(const GasGift& other) {
  volume += other.volume;
  heat += other.heat;
  vapour += other.vapour;
  return *this;
}

GasGift& GasGift::operator*=(double share) {
  volume *= share;
  heat *= share;
  vapour *= share;
  return *this;
}

}  // namespace viscera
