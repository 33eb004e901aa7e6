#include "kernels/heat/generator.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

constexpr double kLeastSpark = 450.0;   // [V]
constexpr double kBreakdown = 2.7e6;    // [V/m]
constexpr double kCathodeFall = 300.0;  // [V]
constexpr double kColumnField = 7e4;    // [V/m]

}  // namespace

Waveform waveform_of(CurrentMode mode) {
  switch (mode) {
    case CurrentMode::kCut:
      return {1150.0, 1.42};
    case CurrentMode::kBlend:
      return {1650.0, 2.7};
    case CurrentMode::kCoagulate:
      return {1750.0, 5.0};
    default:
      return {4250.0, 7.0};
  }
}

double spark_gap(double peak_voltage) {
  return std::max(0.0, (peak_voltage - kLeastSpark) / kBreakdown);
}

SparkDrop spark_drop(double gap) {
  return {0.5 * kCathodeFall, 0.5 * kCathodeFall, kColumnField * std::max(0.0, gap)};
}

GeneratorOutput output_of(const Generator& generator, const Waveform& wave, double power,
                          double resistance, double drop) {
  // R I^2 + drop |I| = P.
  const double by_drop = drop * wave.mean_share();
  const double wanted =
      (std::sqrt(by_drop * by_drop + 4.0 * resistance * power) - by_drop) / (2.0 * resistance);
  const double by_current = std::sqrt(power / generator.least_load);
  const double by_voltage = std::max(0.0, (wave.peak_voltage - drop) / (resistance * wave.crest));
  GeneratorOutput output;
  output.current = std::min({wanted, by_current, by_voltage});
  if (by_current < wanted) output.limit = GeneratorOutput::Limit::kCurrent;
  if (by_voltage < std::min(wanted, by_current)) output.limit = GeneratorOutput::Limit::kVoltage;
  if (output.current <= 0.0) return output;
  const double over_tissue = resistance * output.current;
  output.voltage =
      std::sqrt(over_tissue * over_tissue + 2.0 * over_tissue * drop * wave.mean_share() +
                drop * drop * wave.duty());
  return output;
}

}  // namespace viscera
