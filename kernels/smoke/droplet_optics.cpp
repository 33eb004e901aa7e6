#include "kernels/smoke/droplet_optics.h"

#include <cmath>
#include <numbers>

#include "kernels/smoke/mie.h"

namespace viscera {
namespace {

constexpr int kSizes = 160;        // over which ripples of single sizes are smoothed
constexpr double kReach = 4.0;     // deviations to either side
constexpr double kGravity = 9.81;  // [m/s2]

/// Calls body(diameter, share of the mass) over the distribution.
template <class Body>
void for_each_size(const Droplets& droplets, const Body& body) {
  const double deviation = std::log(droplets.deviation);
  if (!(deviation > 0.0)) {
    body(droplets.median, 1.0);
    return;
  }
  double sum = 0.0;
  for (const bool summing : {true, false})
    for (int i = 0; i < kSizes; ++i) {
      const double at = kReach * (2.0 * (i + 0.5) / kSizes - 1.0);
      const double weight = std::exp(-0.5 * at * at);
      if (summing)
        sum += weight;
      else
        body(droplets.median * std::exp(at * deviation), weight / sum);
    }
}

}  // namespace

SmokeOptics optics_of(const Droplets& droplets, double wavelength) {
  double extinction = 0.0, scattering = 0.0, forward = 0.0;
  for_each_size(droplets, [&](double diameter, double share) {
    const MieEfficiencies one =
        mie(std::numbers::pi * diameter / wavelength, {droplets.refraction, droplets.absorption});
    // Cross-section over mass: (pi d^2 / 4) / (rho pi d^3 / 6).
    const double area = 1.5 * share / (droplets.density * diameter);
    extinction += area * one.extinction;
    scattering += area * one.scattering;
    forward += area * one.scattering * one.asymmetry;
  });
  return {extinction, scattering / extinction, forward / scattering};
}

double settling_speed(const Droplets& droplets, const GasMixture& mixture) {
  const double free_path = gas::kViscosity / mixture.pressure *
                           std::sqrt(std::numbers::pi * gas::kGasConstant * mixture.temperature /
                                     (2.0 * gas::kMolarMass));
  double speed = 0.0;
  for_each_size(droplets, [&](double diameter, double share) {
    const double knudsen = 2.0 * free_path / diameter;
    const double slip = 1.0 + knudsen * (1.257 + 0.4 * std::exp(-1.1 / knudsen));
    speed +=
        share * droplets.density * kGravity * diameter * diameter * slip / (18.0 * gas::kViscosity);
  });
  return speed;
}

}  // namespace viscera
