#include "kernels/heat/damage.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

constexpr double kCoagulatedStiffness = 4.0;
constexpr double kDryStiffness = 4.0;        // on top of that
constexpr double kCollagenShrinkage = 0.10;  // of a length, coagulated
constexpr double kDryCollapse = 0.5;         // of the lost water's volume that closes
constexpr double kRedKelvin = 22135.0;       // h c / (k 650 nm)
constexpr double kFaintest = 800.0;          // [K]

double smooth(double low, double high, double value) {
  const double t = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

TissueState tissue_state(double damage, double water, double charred) {
  TissueState state;
  state.coagulated = -std::expm1(-std::max(0.0, damage));
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

double shrinkage(const TissueState& state, double water_fraction) {
  const double lost = (1.0 - state.wetness) * water_fraction * kDryCollapse;
  return (1.0 - kCollagenShrinkage * state.coagulated) * std::cbrt(1.0 - lost);
}

}  // namespace viscera
