#include "kernels/contact/cell_pattern.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

namespace viscera {
namespace {

TEST(CellPattern, RingsCoverTheDiscWithTheirCentreInIt) {
  const CellPattern pattern = ringed_disc(2.0, 5);
  EXPECT_EQ(pattern.places.size(), 91u);
  EXPECT_NEAR(std::accumulate(pattern.areas.begin(), pattern.areas.end(), 0.0),
              4.0 * std::numbers::pi, 1e-12);
  Vec2 sum = Vec2::Zero();
  for (const Vec2& place : pattern.places) sum += place;
  EXPECT_LT(sum.norm(), 1e-12);
}

TEST(CellPattern, HexagonsAreNeighboursAPitchApart) {
  const CellPattern pattern = hexagonal_grid(0.5, 3);
  EXPECT_EQ(pattern.places.size(), 37u);
  EXPECT_EQ(pattern.places.front(), Vec2(0, 0));
  for (const Vec2& one : pattern.places) {
    double nearest = 1e9;
    for (const Vec2& other : pattern.places) {
      if (one != other) nearest = std::min(nearest, (one - other).norm());
    }
    EXPECT_NEAR(nearest, 0.5, 1e-12);
  }
}

/// The pattern that covers the punch exactly loses a share of its radius in proportion to the width
/// of a cell: the order of constant cells under a pressure that grows as (distance to edge)^-1/2.
TEST(CellPattern, FinerPatternsAnswerAsThePunchTheyCover) {
  for (const double nu : {0.0, 0.3, 0.45, 0.499}) {
    for (const bool sticks : {false, true}) {
      double coarse = 0.0;
      for (const int rings : {3, 6, 12}) {
        if (sticks && rings == 12) continue;
        const double missing = 1.0 - punch_radius(ringed_disc(1.0, rings), nu, sticks);
        std::printf("nu %.3f %s, %d rings: radius %.3f %% short\n", nu,
                    sticks ? "bonded" : "frictionless", rings, 100.0 * missing);
        EXPECT_GT(missing, 0.0);
        EXPECT_LT(missing, 0.2 / rings);
        if (coarse > 0.0) {
          EXPECT_NEAR(missing / coarse, 0.5, 0.1);
        }
        coarse = missing;
      }
    }
  }
}

TEST(CellPattern, FittedPatternHasTheRadiusAtEveryScale) {
  for (const double radius : {1e-3, 0.7}) {
    const CellPattern pattern = fitted_to_punch(hexagonal_grid(1.0, 2), radius, 0.45, true);
    EXPECT_NEAR(punch_radius(pattern, 0.45, true) / radius, 1.0, 1e-9);
  }
}

TEST(CellPattern, BondedAndSlidingPunchesAgreeWhereTheBodyIsIncompressible) {
  // At nu = 1/2 pressing doesn't drag the surface sideways.
  const CellPattern pattern = ringed_disc(1.0, 3);
  EXPECT_NEAR(punch_radius(pattern, 0.5, true), punch_radius(pattern, 0.5, false), 1e-9);
}

}  // namespace
}  // namespace viscera
