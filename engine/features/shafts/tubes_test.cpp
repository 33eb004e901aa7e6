#include "engine/features/shafts/tubes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/base/random.h"

namespace viscera::test {
namespace {

Tube random_tube(const Random& random, std::uint64_t& draw) {
  const auto place = [&] {
    Vec3 one;
    for (double& x : one) x = random.uniform(draw++);
    return one;
  };
  Tube tube;
  tube.tip = place();
  tube.pivot = place();
  return tube;
}

/// By places of both, the best of them refined.
double nearest_by_trying(const Tube& one, const Tube& other) {
  const auto apart = [&](double s, double t) {
    return (one.tip + s * (one.pivot - one.tip) - other.tip - t * (other.pivot - other.tip)).norm();
  };
  double s = 0.5, t = 0.5, least = apart(s, t);
  for (double step = 0.25; step > 1e-7; step *= 0.7) {
    const double s_mid = s, t_mid = t;
    for (int i = -4; i <= 4; ++i)
      for (int j = -4; j <= 4; ++j) {
        const double si = std::clamp(s_mid + 0.5 * i * step, 0.0, 1.0),
                     tj = std::clamp(t_mid + 0.5 * j * step, 0.0, 1.0);
        if (const double here = apart(si, tj); here < least) least = here, s = si, t = tj;
      }
  }
  return least;
}

TEST(Tubes, AreNearestWhereTryingFindsThem) {
  const Random random(11, 0);
  std::uint64_t draw = 0;
  int crossing = 0;
  for (int i = 0; i < 200; ++i) {
    const Tube one = random_tube(random, draw), other = random_tube(random, draw);
    const TubesNearest near = nearest(one, other);
    const Vec3 between = near.on_one - near.on_other;
    EXPECT_NEAR(between.norm(), nearest_by_trying(one, other), 1e-5) << i;
    if (!near.across) continue;
    ++crossing;
    EXPECT_NEAR(between.cross(*near.across).norm(), 0.0, 1e-12) << i;
  }
  EXPECT_GT(crossing, 20);
  EXPECT_LT(crossing, 180);
}

TEST(Tubes, ThatAreParallelOrHaveNoLengthHaveADistanceToo) {
  const Tube one{Vec3::Zero(), Vec3::UnitX(), 0.0},
      above{Vec3(0.5, 0, 2.0), Vec3(3.0, 0, 2.0), 0.0},
      point{Vec3(0.5, 1.0, 0.0), Vec3(0.5, 1.0, 0.0), 0.0};
  const TubesNearest parallel = nearest(one, above);
  EXPECT_NEAR((parallel.on_one - parallel.on_other).norm(), 2.0, 1e-12);
  EXPECT_FALSE(parallel.across);
  EXPECT_FALSE(nearest(one, point).across);
}

TEST(Tubes, BendAsClampedBeamsDo) {
  // 5 mm wide with a bore of 4 mm: I = pi (5^4 - 4^4) / 64 = 18.11 mm4.
  const Tube tube{Vec3::Zero(), Vec3(0.3, 0, 0), 2.5e-3};
  EXPECT_NEAR(bending_stiffness(tube, Vec3(0.1, 0, 0)), 3.0 * 193e9 * 18.113e-12 / 8e-3, 0.5);
  EXPECT_EQ(bending_stiffness(tube, Vec3(0.29, 0, 0)), kStiffestTube);
  EXPECT_EQ(bending_stiffness(tube, tube.pivot), kStiffestTube);
}

}  // namespace
}  // namespace viscera::test
