#include "engine/verification/uniaxial.h"

#include <cmath>

namespace viscera {
namespace {

constexpr int kHalvings = 100;

}  // namespace

UniaxialAnswer uniaxial(const IsotropicMaterial& material, double stretch) {
  const double mu = material.shear_modulus(), lambda = material.lame_lambda();
  UniaxialAnswer answer{.stretch = stretch};
  // dW/dt over 2 t: mu + l (-mu + (lambda + mu) (l t^2 - 1)) = 0.
  const double squared = ((mu - mu / stretch) / (lambda + mu) + 1.0) / stretch;
  answer.across = std::sqrt(squared);
  const double volume = stretch * squared;
  answer.nominal = mu * stretch + squared * (-mu + (lambda + mu) * (volume - 1.0));
  answer.pressure = -answer.nominal / squared;
  return answer;
}

UniaxialAnswer pressed_to(const IsotropicMaterial& material, double pressure) {
  double low = 0.05, high = 1.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (uniaxial(material, middle).pressure > pressure ? low : high) = middle;
  }
  return uniaxial(material, high);
}

}  // namespace viscera
