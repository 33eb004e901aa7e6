// Tissue under a tool by figures: its energy, its slope, when force passes from hive to hive, and
// what a moving scene puts in.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "haptics/hive_tissue.h"
#include "tests/support/height_field.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

constexpr double kBody = 0.04;  // radius of the organ [m]
constexpr double kBall = 4e-3;  // and of the tool
constexpr double kTick = 1e-3;
constexpr int kBlend = 16;  // ticks in which the force passes to another hive

HiveTissueSettings settings_of(double young = 5e3) {
  HiveTissueSettings settings;
  settings.building = HiveBuilding::kInLockstep;
  settings.tool_radius = kBall;
  settings.hive.material = {young, 0.45};
  settings.hive.radius = 4.0 * kBall;
  settings.hive.nodes = 80;
  return settings;
}

/// Tissue that a tool is in, tick by tick.
struct Tissue {
  explicit Tissue(const HiveTissueSettings& settings = settings_of(),
                  TriangleSurface shape = icosphere(kBody, 4))
      : surface(WalkableSurface::make(std::move(shape)).value()),
        tissue(HiveTissue::create({&surface, nullptr, nullptr}, settings).value()) {}
  void tell(const Vec3& place, const Vec3& near, const Vec3& velocity = Vec3::Zero()) {
    TissueSnapshot& snapshot = tissue->snapshots().back();
    snapshot.pose.position = place;
    snapshot.velocity = velocity;
    snapshot.tick = tick;
    snapshot.nearest = surface.nearest(near - place).point;
    tissue->snapshots().publish();
  }
  TactileForce at(const Vec3& tip) {
    ToolMotion motion;
    motion.pose.position = tip;
    motion.velocity = tick == 0 ? Vec3(Vec3::Zero()) : Vec3((tip - last) / kTick);
    motion.tick = tick++;
    last = tip;
    return tissue->respond(motion, kTick);
  }
  WalkableSurface surface;
  std::unique_ptr<HiveTissue> tissue;
  Vec3 last = Vec3::Zero();
  std::uint64_t tick = 0;
};

Vec3 pressed(double depth, double angle = 0.0) {
  return (kBody + kBall - depth) * Vec3(std::sin(angle), 0.1, std::cos(angle)).normalized();
}

TEST(HiveTissue, ItsEnergyIsTheWorkThatPressedIt) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  for (int i = 0; i < 60; ++i) organ.at(pressed(-1e-3));
  double work = 0.0;
  Vec3 before = pressed(-1e-3), force = Vec3::Zero();
  TactileForce felt;
  for (int i = 0; i <= 300; ++i) {
    const Vec3 to = pressed(-1e-3 + 1e-5 * i);
    felt = organ.at(to);
    work -= 0.5 * (force + felt.force).dot(to - before);
    force = felt.force;
    before = to;
  }
  ASSERT_GT(work, 0.0);
  EXPECT_NEAR(felt.energy, work, 0.1 * work);
}

TEST(HiveTissue, ForceEnergyAndSlopeAreProportionalToYoungsModulus) {
  const auto felt = [](double young) {
    Tissue organ(settings_of(young));
    organ.tell(Vec3::Zero(), pressed(0));
    TactileForce one;
    for (int i = 0; i < 60; ++i) one = organ.at(pressed(1e-3));
    return one;
  };
  const TactileForce liver = felt(5e3), jelly = felt(5.0);
  EXPECT_GT(liver.stiffness.norm(), 1.0);
  EXPECT_LT(jelly.stiffness.norm(), 1.0);
  EXPECT_NEAR(1e3 * jelly.force.norm(), liver.force.norm(), 1e-6 * liver.force.norm());
  EXPECT_NEAR(1e3 * jelly.energy, liver.energy, 1e-6 * liver.energy);
  EXPECT_NEAR(1e3 * jelly.stiffness.norm(), liver.stiffness.norm(), 1e-3 * liver.stiffness.norm());
}

TEST(HiveTissue, AToolThatAppearsInTissueIsMetByAForceThatGrowsOverSixteenTicks) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  std::vector<double> forces;
  while (forces.size() < 40) {
    const double force = organ.at(pressed(1e-3)).force.norm();
    ASSERT_LT(organ.tick, 100u);
    if (force > 0.0 || !forces.empty()) forces.push_back(force);
  }
  const double whole = forces.back();
  for (int i = 1; i <= kBlend; ++i) {
    const double s = static_cast<double>(i) / kBlend;
    EXPECT_NEAR(forces[static_cast<std::size_t>(i - 1)], (3.0 - 2.0 * s) * s * s * whole,
                1e-6 * whole)
        << i;
  }
}

TEST(HiveTissue, WhereTheOldHiveHasNoAnswerTheNewOneSpeaksForBoth) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  for (int i = 0; i < 60; ++i) organ.at(pressed(1e-3));
  ASSERT_EQ(organ.tissue->figures().hives, 1u);
  // 2 cm aside within a tick: beyond what the hive answers.
  const Vec3 aside = pressed(1e-3, 0.5);
  double first = 0.0, whole = 0.0;
  for (int i = 0; i < 60; ++i) {
    whole = organ.at(aside).force.norm();
    if (first == 0.0) first = whole;
  }
  EXPECT_GE(organ.tissue->figures().hives, 2u);
  EXPECT_GT(organ.tissue->figures().uncovered, 0u);
  EXPECT_GT(whole, 0.0);
  EXPECT_NEAR(first, whole, 0.01 * whole) << "but for what two hives differ by";
}

TEST(HiveTissue, OneHiveAtATimeTakesOver) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  for (int i = 0; i < 60; ++i) organ.at(pressed(1e-3));
  // 0.4 m/s: the next hive is wanted sooner than the last has taken over.
  std::uint64_t hives = organ.tissue->figures().hives;
  int taken = 0, since = 1000;
  bool covered = true;
  for (int i = 0; i < 150; ++i) {
    organ.at(pressed(1e-3, 4e-4 / kBody * i));
    ++since;
    if (organ.tissue->figures().hives > hives) {
      EXPECT_TRUE(since >= kBlend || !covered) << i;
      hives = organ.tissue->figures().hives;
      since = 0;
      ++taken;
    }
    covered = organ.tissue->state().covered;
  }
  EXPECT_GE(taken, 4);
}

TEST(HiveTissue, TheNextHiveIsBegunWhereThePatternsRimIsThreeFifthsOutAndNoSooner) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  for (int i = 0; i < 60; ++i) organ.at(pressed(1e-3));
  const Hive& hive = *organ.tissue->hive();
  const double usable = hive.usable_radius(), step = 5e-5;
  for (int i = 0; i < 400 && !organ.tissue->state().builder.busy; ++i)
    organ.at(pressed(1e-3, step / kBody * i));
  const ToolFoot& foot = organ.tissue->foot();
  const double rim = (foot.spot().position - hive.centre().position).norm() + foot.across();
  EXPECT_GE(rim, 0.6 * usable);
  EXPECT_LT(rim, 0.6 * usable + 3.0 * step);
}

TEST(HiveTissue, AToolWhoseCentreIsInTheTissueStandsOnAPlaceThatMovesSmoothly) {
  // Facets of 11 mm: the place nearest to a centre 3 mm inside jumps at their edges.
  Tissue organ(settings_of(), icosphere(kBody, 2));
  organ.tell(Vec3::Zero(), pressed(0));
  const double step = 5e-5;
  Vec3 last = Vec3::Zero();
  double worst = 0.0;
  for (int i = 0; i < 500; ++i) {
    organ.at(pressed(kBall + 3e-3, step / kBody * i));
    const Vec3 place = organ.tissue->foot().spot().position;
    if (i > 0) worst = std::max(worst, (place - last).norm());
    last = place;
  }
  EXPECT_LT(worst, 5.0 * step);
}

TEST(HiveTissue, TheNextHiveStandsHalfOfTheLastAheadAtMost) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  for (int i = 0; i < 60; ++i) organ.at(pressed(1e-3));
  const double usable = organ.tissue->hive()->usable_radius();
  // At 1 m/s it would stand 2 cm ahead.
  int i = 0;
  while (!organ.tissue->state().builder.busy && i < 100)
    organ.at(pressed(1e-3, 1e-3 / kBody * ++i));
  const Vec3 asked_at = organ.tissue->foot().spot().position;
  while (organ.tissue->figures().hives < 2 && i < 200) organ.at(pressed(1e-3, 1e-3 / kBody * ++i));
  const double ahead = (organ.tissue->hive()->centre().position - asked_at).norm();
  EXPECT_NEAR(ahead, 0.5 * usable, 0.03 * usable);
}

TEST(HiveTissue, AToolTooWideForItsHiveGainsNothingFromAnotherInItsPlace) {
  HiveTissueSettings settings = settings_of();
  settings.hive.radius = 1.6 * kBall;
  Tissue organ(settings);
  organ.tell(Vec3::Zero(), pressed(0));
  for (int i = 0; i < 100; ++i) organ.at(pressed(1.5e-3));
  ASSERT_GT(organ.tissue->foot().across(), 0.6 * organ.tissue->hive()->usable_radius());
  EXPECT_EQ(organ.tissue->figures().hives, 1u);
}

TEST(HiveTissue, TissueHasNotMovedBeforeItsSnapshotAndGoesOnFromThere) {
  const auto depth_after = [](std::uint64_t asked, double velocity) {
    Tissue organ;
    organ.tick = 100;
    organ.tell(Vec3::Zero(), pressed(0), Vec3(0.0, 0.0, velocity));
    organ.tick = asked;
    organ.at((kBody + kBall - 2e-3) * Vec3::UnitZ());
    return organ.tissue->foot().depth();
  };
  const double still = depth_after(100, 0.0);
  EXPECT_NEAR(still, 2e-3, 2e-4);
  EXPECT_EQ(depth_after(100, -0.1), still);
  EXPECT_EQ(depth_after(90, -0.1), still);
  EXPECT_NEAR(depth_after(110, -0.1), still - 1e-3, 2e-5);
}

TEST(HiveTissue, AMovingSceneSuppliesForceTimesWayAndAStalledOneNothing) {
  for (const bool relaxes : {false, true}) {
    HiveTissueSettings settings = settings_of();
    if (relaxes) settings.prony = {{0.5, 0.2}};
    Tissue organ(settings);
    organ.tell(Vec3::Zero(), pressed(0), Vec3(0.0, 0.0, 0.01));
    TactileForce felt;
    for (int i = 0; i < 25; ++i) felt = organ.at(pressed(1e-3));
    EXPECT_GT(felt.force.z(), 1e-3);
    EXPECT_NEAR(felt.supplied, felt.force.z() * 0.01 * kTick, 1e-9 * felt.supplied);
    for (int i = 0; i < 25; ++i) felt = organ.at(pressed(1e-3));
    EXPECT_GT(felt.force.z(), 1e-3);
    EXPECT_EQ(felt.supplied, 0.0) << "no frame for 34 ticks";
  }
}

TEST(HiveTissue, TissueThatSinksAwaySuppliesNothing) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0), Vec3(0.0, 0.0, -0.01));
  TactileForce felt;
  for (int i = 0; i < 25; ++i) felt = organ.at(pressed(2e-3));
  EXPECT_GT(felt.force.z(), 1e-3);
  EXPECT_EQ(felt.supplied, 0.0);
}

TEST(HiveTissue, AJumpThatIsEasedSuppliesTheWorkOfItsWay) {
  Tissue organ;
  const Vec3 tip = pressed(1e-3);
  for (int frame = 0; frame < 4; ++frame) {
    organ.tell(Vec3::Zero(), tip);
    for (int i = 0; i < 17; ++i) organ.at(tip);
  }
  const double before = organ.at(tip).force.z();
  organ.tell(Vec3(0.0, 0.0, 1e-3), tip);
  double supplied = 0.0, after = 0.0;
  for (int i = 0; i < 40; ++i) {
    const TactileForce felt = organ.at(tip);
    supplied += felt.supplied;
    after = felt.force.z();
  }
  EXPECT_GT(after, 2.0 * before);
  EXPECT_GT(supplied, before * 1e-3);
  EXPECT_LT(supplied, after * 1e-3);
}

TEST(HiveTissue, AfterAStallTheSceneIsEasedForAQuarterOfASecondAndNoLonger) {
  Tissue organ;
  const Vec3 tip = pressed(0.5e-3);
  for (int frame = 0; frame < 2; ++frame) {
    organ.tell(Vec3::Zero(), tip);
    for (int i = 0; i < 400; ++i) organ.at(tip);
  }
  organ.tell(Vec3(0.0, 0.0, 1e-3), tip);
  std::vector<double> forces;
  for (int i = 0; i < 300; ++i) forces.push_back(organ.at(tip).force.norm());
  EXPECT_LT(forces[230], 0.999 * forces.back());
  EXPECT_NEAR(forces[251], forces.back(), 1e-9 * forces.back());
}

/// A groove z = |x| along y, of squares of 2 mm.
TriangleSurface groove() {
  return height_field(20, 2e-3, [](double x, double) { return std::abs(x); });
}

TEST(HiveTissue, AcrossAGrooveTheOtherWallIsTakenWhereItIsHalfAMillimetreNearer) {
  HiveTissueSettings settings = settings_of();
  settings.hive.radius = 2.9e-3;  // followed as far as three times that
  Tissue organ(settings, groove());
  // 1 cm above the bottom the walls are (1 cm -+ x) / sqrt 2 away.
  const auto over = [](double x) { return Vec3(x, 0.0, 1e-2); };
  const auto stands_at = [&](double x) {
    organ.tell(Vec3::Zero(), over(x));
    organ.at(over(x));
    return organ.tissue->foot().spot().position.x();
  };
  const std::uint64_t before = organ.tissue->figures().searches;
  EXPECT_NEAR(stands_at(-1e-3), -5.5e-3, 1e-6);
  const std::uint64_t first = organ.tissue->figures().searches;
  EXPECT_GE(first, before);
  EXPECT_NEAR(stands_at(0.2e-3), -4.9e-3, 1e-6) << "0.28 mm nearer";
  EXPECT_EQ(organ.tissue->figures().searches, first);
  EXPECT_NEAR(stands_at(0.5e-3), 5.25e-3, 1e-6) << "0.71 mm nearer";
  EXPECT_EQ(organ.tissue->figures().searches, first + 1);
}

TEST(HiveTissueState, OfAFirstHiveUnderConstructionFitsAndOneOfTwoPartsDoesNot) {
  Tissue organ;
  organ.tell(Vec3::Zero(), pressed(0));
  organ.at(pressed(-1e-3));
  const HiveTissue::State state = organ.tissue->state();
  ASSERT_TRUE(state.builder.busy);
  ASSERT_EQ(state.next, 0);
  EXPECT_TRUE(organ.tissue->fits(state));
  for (int i = 0; i < 30; ++i) organ.at(pressed(-1e-3));
  for (int hive = 0; hive < 3; ++hive) {
    HiveTissue::State twice = organ.tissue->state();
    EXPECT_TRUE(organ.tissue->fits(twice));
    twice.now = twice.before = hive;
    EXPECT_FALSE(organ.tissue->fits(twice)) << hive;
  }
}

}  // namespace
}  // namespace viscera::test
