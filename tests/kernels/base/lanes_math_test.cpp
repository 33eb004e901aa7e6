#include "kernels/base/lanes_math.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

// Over twelve decades, eight at once.
template <class Check>
void over_decades(const Check& check) {
  for (int i = 0; i < 4800; i += kLanes) {
    Lanes x = {};
    for (int l = 0; l < kLanes; ++l)
      x[l] = static_cast<float>(std::pow(10.0, -6.0 + (i + l) / 400.0));
    check(x);
  }
}

TEST(LanesMath, SquareRootIsRightToItsLastDigits) {
  over_decades([](const Lanes& x) {
    Lanes y;
    square_root(y, x);
    for (int l = 0; l < kLanes; ++l) EXPECT_NEAR(y[l] / std::sqrt(x[l]), 1.0f, 3e-7f) << x[l];
  });
  Lanes none;
  square_root(none, Lanes{});
  EXPECT_EQ(none[0], 0.0f);
}

TEST(LanesMath, ArcTangentIsRightToItsLastDigits) {
  over_decades([](const Lanes& x) {
    Lanes y;
    arc_tangent(y, x);
    for (int l = 0; l < kLanes; ++l) EXPECT_NEAR(y[l], std::atan(x[l]), 2e-7f) << x[l];
  });
}

TEST(LanesMath, ExponentialIsRightToItsLastDigits) {
  for (int i = -8000; i < 8000; i += kLanes) {
    Lanes x = {};
    for (int l = 0; l < kLanes; ++l) x[l] = static_cast<float>(i + l) * 0.01f;
    Lanes y;
    exponential(y, x);
    for (int l = 0; l < kLanes; ++l) EXPECT_NEAR(y[l] / std::exp(x[l]), 1.0f, 1e-6f) << x[l];
  }
}

}  // namespace
}  // namespace viscera
