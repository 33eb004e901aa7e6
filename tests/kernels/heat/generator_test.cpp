// What a generator gives, against its waves added up sample by sample.
#include "kernels/heat/generator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr CurrentMode kModes[] = {CurrentMode::kCut, CurrentMode::kBlend, CurrentMode::kCoagulate,
                                  CurrentMode::kFulgurate};

/// Means of a current that flows in bursts of a sine, and of what it does in a resistance with a
/// spark in series, whose drop has the current's sign.
struct Sampled {
  double mean = 0.0, current = 0.0, voltage = 0.0;  ///< of its size; root mean squares
  double in_resistance = 0.0, in_spark = 0.0;       ///< [W]
  double peak = 0.0;                                ///< of the voltage [V]
};
Sampled sampled(const Waveform& wave, double current, double resistance, double drop) {
  const double peak = wave.crest * current;
  constexpr int kBurst = 100000;
  const int all = static_cast<int>(std::lround(kBurst / std::min(1.0, wave.duty())));
  Sampled s;
  for (int i = 0; i < kBurst; ++i) {
    const double now = peak * std::sin(2.0 * std::numbers::pi * (i + 0.5) / kBurst * 10.0);
    const double voltage = resistance * now + std::copysign(drop, now);
    s.mean += std::abs(now) / all;
    s.current += now * now / all;
    s.voltage += voltage * voltage / all;
    s.in_resistance += resistance * now * now / all;
    s.in_spark += drop * std::abs(now) / all;
    s.peak = std::max(s.peak, std::abs(voltage));
  }
  s.current = std::sqrt(s.current);
  s.voltage = std::sqrt(s.voltage);
  return s;
}

TEST(Generator, MeanAndDutyOfAWaveFollowFromItsCrest) {
  for (const CurrentMode mode : kModes) {
    const Waveform wave = waveform_of(mode);
    const Sampled s = sampled(wave, 0.3, 1.0, 0.0);
    EXPECT_NEAR(s.current, 0.3, 1e-4);
    EXPECT_NEAR(s.mean, wave.mean_share() * 0.3, 1e-4);
    EXPECT_LE(wave.duty(), 1.0);
  }
  EXPECT_NEAR(Waveform{}.duty(), 1.0, 1e-12);
  EXPECT_NEAR(Waveform{}.mean_share(), 2.0 * std::numbers::sqrt2 / std::numbers::pi, 1e-12);
  // A spark's drop times the root mean square would be so many times too much.
  EXPECT_NEAR(1.0 / waveform_of(CurrentMode::kFulgurate).mean_share(), 5.5, 0.01);
}

TEST(Generator, PowerOfResistanceAndSparkIsWhatItIsSetTo) {
  for (const CurrentMode mode : kModes) {
    for (const double resistance : {200.0, 900.0, 2000.0}) {
      for (const double drop : {0.0, 100.0, 370.0}) {
        const Waveform wave = waveform_of(mode);
        const GeneratorOutput output = output_of(Generator{}, wave, 10.0, resistance, drop);
        const Sampled s = sampled(wave, output.current, resistance, drop);
        ASSERT_EQ(output.limit, GeneratorOutput::Limit::kPower);
        EXPECT_NEAR(s.in_resistance + s.in_spark, 10.0, 0.01);
        EXPECT_NEAR(s.voltage, output.voltage, 1e-3 * output.voltage);
        EXPECT_LE(s.peak, wave.peak_voltage);
      }
    }
  }
}

TEST(Generator, ItsVoltageIsALimitOfPeaks) {
  for (const CurrentMode mode : kModes) {
    for (const double drop : {0.0, 350.0}) {
      const Waveform wave = waveform_of(mode);
      const GeneratorOutput output = output_of(Generator{}, wave, 100.0, 40e3, drop);
      EXPECT_EQ(output.limit, GeneratorOutput::Limit::kVoltage);
      EXPECT_NEAR(sampled(wave, output.current, 40e3, drop).peak, wave.peak_voltage,
                  1e-3 * wave.peak_voltage);
    }
  }
  const Waveform cut = waveform_of(CurrentMode::kCut);
  EXPECT_EQ(output_of(Generator{}, cut, 30.0, 100.0, 2000.0).current, 0.0) << "no spark burns";
}

TEST(Generator, IntoAShortItsCurrentIsHeld) {
  const Generator generator;
  const Waveform cut = waveform_of(CurrentMode::kCut);
  const double held = std::sqrt(50.0 / generator.least_load);
  for (const double resistance : {1.0, 20.0, 0.9 * generator.least_load}) {
    const GeneratorOutput output = output_of(generator, cut, 50.0, resistance, 0.0);
    EXPECT_EQ(output.limit, GeneratorOutput::Limit::kCurrent);
    EXPECT_NEAR(output.current, held, 1e-12);
    EXPECT_NEAR(output.current * output.current * resistance,
                50.0 * resistance / generator.least_load, 1e-9);
  }
  const GeneratorOutput above = output_of(generator, cut, 50.0, 1.1 * generator.least_load, 0.0);
  EXPECT_EQ(above.limit, GeneratorOutput::Limit::kPower);
  EXPECT_LT(above.current, held);
}

TEST(Generator, ASparkKeepsMoreTheWiderItsGapAndLessThanWhatLitIt) {
  EXPECT_GT(spark_drop(1e-3).whole(), spark_drop(0.1e-3).whole());
  EXPECT_EQ(spark_drop(0.0).column, 0.0);
  for (const CurrentMode mode : kModes) {
    const double peak = waveform_of(mode).peak_voltage, gap = spark_gap(peak);
    EXPECT_GT(gap, 0.0);
    EXPECT_LT(spark_drop(gap).whole(), peak);
    // The breakdown of any gap is more than its glow.
    for (const double part : {0.1, 0.5, 1.0})
      EXPECT_LT(spark_drop(part * gap).whole(), 450.0 + part * (peak - 450.0));
  }
}

}  // namespace
}  // namespace viscera
