#include "kernels/smoke/splat_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace viscera {
namespace {

// From a level to the next r^2 grows by a half, so that the peak of a kernel between two of them is
// at most 8 % off; at first, where all kernels are a few cells wide, by more.
constexpr float kGrowth = 1.5f, kFirstGrowth = 1.5f;

/// Of a tent sampled at cells, normalised: on one side, from the middle on.
std::vector<double> sampled_tent(double radius) {
  std::vector<double> weights = {1.0};
  double sum = 1.0;
  for (int i = 1; i < radius; ++i) {
    weights.push_back(1.0 - i / radius);
    sum += 2.0 * weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

double variance(const std::vector<double>& weights) {
  double sum = 0.0;
  for (std::size_t i = 1; i < weights.size(); ++i)
    sum += 2.0 * weights[i] * static_cast<double>(i * i);
  return sum;
}

std::vector<float> blur(double wanted_variance) {
  double low = 1.0, high = kWidestSplat + 1.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (variance(sampled_tent(middle)) < wanted_variance ? low : high) = middle;
  }
  const std::vector<double> exact = sampled_tent(high);
  std::vector<float> weights(exact.size());
  double rest = 1.0;
  for (std::size_t i = 1; i < exact.size(); ++i) {
    const double whole = std::round(exact[i] * 0x1p24) * 0x1p-24;
    weights[i] = static_cast<float>(whole);
    rest -= 2.0 * whole;
  }
  weights[0] = static_cast<float>(rest);
  return weights;
}

}  // namespace

std::vector<SplatLevel> splat_levels(const SplatParameters& parameters) {
  const float widest = splat_square(parameters, std::numeric_limits<float>::max());
  std::vector<SplatLevel> levels(1);
  while (levels.back().square < widest) {
    const float last = levels.back().square;
    const float square = std::min(std::max(kGrowth * last, last + kFirstGrowth), widest);
    levels.push_back({square, blur((static_cast<double>(square) - last) / 6.0)});
  }
  return levels;
}

}  // namespace viscera
