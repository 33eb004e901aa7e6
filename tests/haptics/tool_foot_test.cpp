// Where a ball stands, on surfaces whose heights and slopes one can write down.
#include "haptics/tool_foot.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/contact/cell_pattern.h"
#include "tests/support/height_field.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

constexpr double kBall = 4e-3, kDeep = 1e-3, kReach = 0.05;  // [m]
constexpr double kFall = 0.2;                                // of the roof's sides

/// A roof z = -kFall |x| with its crest along y, of squares of 2 mm.
WalkableSurface roof() {
  return WalkableSurface::make(
             height_field(40, 2e-3, [](double x, double) { return -kFall * std::abs(x); }))
      .value();
}

/// A ball pressed so deep into the roof's crest.
ToolFoot on_the_crest(const WalkableSurface& surface) {
  ToolFoot foot(kBall, 2, CellWays::kTogether);
  const Vec3 centre(0.0, 0.0, kBall - kDeep);
  foot.start(surface.nearest(Vec3::Zero()), centre);
  EXPECT_TRUE(foot.follow(surface, centre, kReach));
  foot.lay_cells(surface);
  return foot;
}

// 1.35 sqrt(4 mm x 1 mm) + 0.15 x 4 mm.
constexpr double kAcross = 3.3e-3;

TEST(ToolFoot, ThePatternIsAThirdWiderThanABallsContactAndItsCellsLieOnTheGrid) {
  const WalkableSurface surface = roof();
  const ToolFoot foot = on_the_crest(surface);
  EXPECT_NEAR(foot.depth(), kDeep, 1e-9);
  EXPECT_NEAR(foot.up().z(), 1.0, 1e-9);
  EXPECT_NEAR(foot.across(), kAcross, 1e-9);
  const double pitch = kAcross / 2.1;  // two rings and a bit
  const auto places = hexagonal_grid(pitch, 2).places;
  ASSERT_EQ(foot.cells().size(), places.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vec3& at = foot.cells()[k].position;
    EXPECT_NEAR(at.x(), places[k].x(), 2e-3 * pitch) << k;
    EXPECT_NEAR(at.y(), places[k].y(), 2e-3 * pitch) << k;
    EXPECT_NEAR(at.z(), -kFall * std::abs(at.x()), 1e-9) << k;
    EXPECT_NEAR(foot.cells()[k].area, std::sqrt(0.75) * pitch * pitch, 1e-12);
    // The ball above the cell, from its centre at 3 mm.
    const double bottom =
        kBall - kDeep - std::sqrt(kBall * kBall - at.x() * at.x() - at.y() * at.y());
    EXPECT_NEAR(foot.depths()[k], at.z() - bottom, 1e-9) << k;
  }
}

TEST(ToolFoot, CellsAPitchFromTheCrestLeanByTheirOwnSideAlone) {
  const WalkableSurface surface = roof();
  const ToolFoot foot = on_the_crest(surface);
  const double pitch = kAcross / 2.1;
  int left = 0, right = 0;
  for (std::size_t k = 0; k < foot.cells().size(); ++k) {
    const double x = foot.cells()[k].position.x();
    if (std::abs(x) < 0.9 * pitch) continue;  // sees both sides
    ++(x < 0.0 ? left : right);
    // Tissue that falls to the right pushes a tool to the right.
    EXPECT_NEAR(foot.pushes()[k].x(), x < 0.0 ? -kFall : kFall, 2e-3) << k;
    EXPECT_NEAR(foot.pushes()[k].y(), 0.0, 2e-3) << k;
    EXPECT_NEAR(foot.pushes()[k].z(), 1.0, 1e-9) << k;
  }
  EXPECT_EQ(left, 6);
  EXPECT_EQ(right, 6);
  EXPECT_NEAR(foot.pushes()[0].x(), 0.0, 2e-3) << "on the crest";
}

TEST(ToolFoot, AnEdgeTurnsItWithinTwoRadiiOfTheBallAndNoFarther) {
  const WalkableSurface surface = roof();
  const Vec3 normal = Vec3(kFall, 0.0, 1.0).normalized();
  const auto up_at = [&](double x) {
    const Vec3 place(x, 0.0, -kFall * x);
    ToolFoot foot(kBall, 2, CellWays::kTogether);
    const Vec3 centre = place + (kBall - kDeep) * normal;
    foot.start(surface.nearest(place), centre);
    EXPECT_TRUE(foot.follow(surface, centre, kReach));
    return foot.up();
  };
  // From 10 mm a ring of 8 mm doesn't reach the crest, nor the squares beside it.
  EXPECT_NEAR((up_at(11e-3) - normal).norm(), 0.0, 1e-9);
  EXPECT_LT(up_at(5e-3).x(), normal.x() - 0.01);
}

TEST(ToolFoot, IsWholeUntilAnEdgeComesUnderTheBall) {
  const auto whole_at = [](double fall, double off) {
    const WalkableSurface surface =
        WalkableSurface::make(height_field(120, 0.5e-3, [&](double x, double) {
          return -fall * std::max(0.0, x);
        })).value();
    ToolFoot foot(kBall, 2, CellWays::kTogether);
    const Vec3 place(-off, 0.0, 0.0), centre = place + Vec3(0.0, 0.0, kBall - kDeep);
    foot.start(surface.nearest(place), centre);
    EXPECT_TRUE(foot.follow(surface, centre, kReach));
    foot.lay_cells(surface);
    return foot.whole();
  };
  // A plane that ends in a slope of 73 degrees, and in one of 31.
  EXPECT_TRUE(whole_at(3.3, 8e-3));
  EXPECT_FALSE(whole_at(3.3, -1e-3));
  EXPECT_TRUE(whole_at(0.6, -1e-3));
}

TEST(ToolFoot, AToolWhoseCentreIsInTheTissueHasAFootThatMovesSmoothly) {
  // Facets of 11 mm: the nearest place of a centre 3 mm inside jumps at their edges.
  const double body = 0.04, step = 5e-5;
  const WalkableSurface surface = WalkableSurface::make(icosphere(body, 2)).value();
  const auto centre = [&](int i) {
    const double angle = step * i / body;
    return Vec3((body - 3e-3) * Vec3(std::sin(angle), 0.1, std::cos(angle)).normalized());
  };
  ToolFoot foot(kBall, 2, CellWays::kTogether);
  foot.start(surface.nearest(centre(0)), centre(0));
  ASSERT_TRUE(foot.follow(surface, centre(0), kReach));
  Vec3 last = foot.spot().position;
  double worst = 0.0;
  for (int i = 1; i < 800; ++i) {
    ASSERT_TRUE(foot.follow(surface, centre(i), kReach)) << i;
    worst = std::max(worst, (foot.spot().position - last).norm());
    last = foot.spot().position;
  }
  EXPECT_LT(worst, 5.0 * step);
}

}  // namespace
}  // namespace viscera::test
