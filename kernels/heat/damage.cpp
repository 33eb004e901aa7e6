#include "kernels/heat/damage.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace viscera {
namespace {

// Rates of the fractions that coagulate, over the one rate: a factor of ten to either side, and
// together half done where it is.
constexpr double kMiddle = 0.8355;
constexpr std::array kFractions = {0.1 * kMiddle, 0.316228 * kMiddle, kMiddle, 3.16228 * kMiddle,
                                   10.0 * kMiddle};
constexpr double kAllCoagulated = 300.0;  // Omega; nothing is left to compute

// Of collagen. The step is over within the 150 s in which the samples were heated to 60 C, and so
// in less time than anybody saw [A]; the two of the logarithm are least squares.
constexpr double kUncoiled = 0.02;          // Omega
constexpr double kStepShrinkage = 0.12861;  // of a length, where Omega is 1
constexpr double kCreep = 0.0061761;        // of a length, for every factor e of Omega
constexpr double kNoCollagen = 1e-6;        // Omega

constexpr double kCoagulatedStiffness = 7.0;  // 6.64 to 46.4 kPa
constexpr double kDryStiffness = 4.0;         // on top of that
constexpr double kDryCollapse = 0.5;          // of the lost water's volume that closes
constexpr double kRedKelvin = 22135.0;        // h c / (k 650 nm)
constexpr double kFaintest = 800.0;           // [K]

double smooth(double low, double high, double value) {
  const double t = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

double coagulated_share(double coagulation) {
  if (!(coagulation > 0.0)) return 0.0;
  if (coagulation > kAllCoagulated) return 1.0;
  double share = 0.0;
  for (const double rate : kFractions) share -= std::expm1(-rate * coagulation);
  return share / static_cast<double>(kFractions.size());
}

double collagen_shrinkage(double collagen) {
  if (!(collagen > kNoCollagen)) return 0.0;
  return -std::expm1(-collagen / kUncoiled) * (kStepShrinkage + kCreep * std::log(collagen));
}

TissueState tissue_state(double coagulation, double water, double charred) {
  TissueState state;
  state.coagulated = coagulated_share(coagulation);
  state.charred = std::clamp(charred, 0.0, 1.0);
  // The first tenths of the water don't show: the film on the surface comes from below.
  state.seared = (1.0 - smooth(0.0, 0.6, water)) * (1.0 - state.charred);
  state.wetness = smooth(0.2, 0.9, water) * (1.0 - state.charred);
  return state;
}

double glow(double kelvin) {
  if (!(kelvin > kFaintest)) return 0.0;
  return std::expm1(kRedKelvin / 1000.0) / std::expm1(kRedKelvin / kelvin);
}

double stiffness_factor(const TissueState& state) {
  const double dry = 1.0 - state.wetness;
  return (1.0 + (kCoagulatedStiffness - 1.0) * state.coagulated) *
         (1.0 + (kDryStiffness - 1.0) * dry * state.coagulated);
}

double remaining_length(const TissueState& state, double collagen, double water_fraction) {
  const double lost = (1.0 - state.wetness) * water_fraction * kDryCollapse;
  return (1.0 - collagen_shrinkage(collagen)) * std::cbrt(1.0 - lost);
}

}  // namespace viscera
