#include "kernels/hive/prony.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <vector>

namespace viscera {
namespace {

const std::vector<PronyTerm> kLiver{{0.5, 1.0}, {0.2, 10.0}};

TEST(Prony, AStepBeginsAtTheInstantaneousForceAndRelaxesToTheElasticOne) {
  PronyForce force(kLiver);
  EXPECT_NEAR(force.instantaneous(), 1.0 / 0.3, 1e-12);
  const double rise = 1e-7;
  double time = 0.0;
  EXPECT_NEAR(force.update(2.0, rise), 2.0 / 0.3, 1e-5);
  for (const double dt : {1e-3, 0.1, 0.7, 3.0, 20.0}) {
    time += dt;
    const double exact =
        2.0 * (1.0 + 0.5 / 0.3 * std::exp(-time) + 0.2 / 0.3 * std::exp(-time / 10.0));
    EXPECT_NEAR(force.update(2.0, dt), exact, 1e-5) << time;
  }
  EXPECT_NEAR(force.update(2.0, 1e6), 2.0, 1e-12);
}

TEST(Prony, ARampIsTheClosedFormForAnyTick) {
  for (const double dt : {1e-4, 1e-3, 0.05, 2.0}) {
    PronyForce force(kLiver);
    const double slope = 0.7;
    double last = 0.0;
    const int steps = static_cast<int>(std::lround(4.0 / dt));
    for (int i = 1; i <= steps; ++i) last = force.update(slope * dt * i, dt);
    const double t = dt * steps;
    const double exact = slope * (t + 0.5 / 0.3 * (1.0 - std::exp(-t)) +
                                  0.2 / 0.3 * 10.0 * (1.0 - std::exp(-t / 10.0)));
    EXPECT_NEAR(last, exact, 1e-9 * exact) << dt;
  }
}

TEST(Prony, WithoutTermsItIsTheElasticForce) {
  PronyForce force;
  EXPECT_DOUBLE_EQ(force.update(3.0, 1e-3), 3.0);
  EXPECT_DOUBLE_EQ(force.instantaneous(), 1.0);
}

TEST(Prony, TissueThatRelaxedLetsTheToolGoAndComesBackAtItsOwnRate) {
  PronyForce force(kLiver);
  force.update(1.0, 1e-3);
  force.update(1.0, 100.0);
  EXPECT_EQ(force.update(0.1, 1e-3), 0.0);
  // Back at once: the surface isn't there yet.
  EXPECT_EQ(force.update(0.15, 1e-3), 0.0);
  for (int i = 0; i < 1000; ++i) EXPECT_GE(force.update(0.0, 1e-3), 0.0);
  for (int i = 0; i < 200; ++i) force.update(0.0, 1.0);
  EXPECT_NEAR(force.update(1.0, 1e-7), 1.0 / 0.3, 1e-3);
}

// Depth x, elastic force x + 2 x^3, ticks of any length.
TEST(Prony, ClosedPathsGiveBackNoEnergy) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int path = 0; path < 200; ++path) {
    PronyForce force(kLiver);
    std::vector<double> depths, times;
    for (int i = 0; i < 12; ++i) {
      depths.push_back(std::max(0.0, 1.6 * uniform(random) - 0.4));
      times.push_back(std::pow(10.0, -3.0 + 4.0 * uniform(random)));
    }
    double x = 0.0, last = 0.0, stored = 0.0, work = 0.0;
    for (int round = 0; round < 6; ++round) {
      if (round == 5) work = 0.0;  // periodic by then
      for (std::size_t i = 0; i < depths.size(); ++i) {
        constexpr int kParts = 200;
        const double from = x;
        for (int k = 1; k <= kParts; ++k) {
          const double to = from + (depths[i] - from) * k / kParts;
          const double now = force.update(to + 2.0 * to * to * to, times[i] / kParts);
          work += 0.5 * (now + last) * (to - x);
          stored = std::max(stored, now);
          x = to;
          last = now;
        }
      }
    }
    EXPECT_GE(work, -1e-4 * stored) << path;
  }
}

}  // namespace
}  // namespace viscera
