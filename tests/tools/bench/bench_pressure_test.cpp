// A soft block between plates, up to a pressure of its own modulus.
#include "tools/bench/bench_pressure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr IsotropicMaterial kRubber{10e3, 0.45};
constexpr double kModulus = 10e3;

TEST(ModulusPressure, IsReachedOrRefusedByName) {
  const auto curve = press_block(kRubber, kModulus, {.time = 1.5, .spacing = 6e-3});
  ASSERT_TRUE(curve) << curve.error().text();
  ASSERT_FALSE(curve->frames.empty());
  EXPECT_NEAR(curve->frames.back().pressure, kModulus, 0.02 * kModulus);
  const PressureFrame& last = curve->frames.back();
  EXPECT_TRUE(curve->first_refused() || std::abs(last.force / last.exact - 1.0) < 0.1);
  for (const PressureFrame& frame : curve->frames) {
    if (frame.residual <= 1e-3) continue;
    EXPECT_FALSE(frame.flags.empty()) << frame.pressure;
  }
}

TEST(ModulusPressure, ATenthOfItIsAnsweredNearerByFinerNodes) {
  const auto error = [](double spacing) {
    const auto curve = press_block(kRubber, 0.1 * kModulus, {.time = 0.5, .spacing = spacing});
    EXPECT_TRUE(curve);
    if (!curve) return 1.0;
    EXPECT_EQ(curve->first_refused(), nullptr);
    return std::abs(curve->frames.back().force / curve->frames.back().exact - 1.0);
  };
  const double coarse = error(6e-3), fine = error(4e-3);
  EXPECT_LT(fine, coarse);
  EXPECT_LT(fine, 0.1);
}

}  // namespace
}  // namespace viscera
