#include <gtest/gtest.h>

#include "engine/run.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;

/// A hook that presses the pole of a ball and carries `power` [W] from 0.2 s on.
SceneDescription burning_scene(double power) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kTop + 3e-3), 0.0, 1.0},
                                      {0.2, Vec3(0, 0, kTop + 0.2e-3), power, 1.0},
                                      {1.2, Vec3(3e-3, 0, kTop + 0.0e-3), power, 1.0}})};
  SmokeDescription smoke;
  smoke.name = "plume";
  smoke.domain = Box(Vec3(-30e-3, -30e-3, -30e-3), Vec3(30e-3, 30e-3, 60e-3));
  scene.smoke = {smoke};
  return scene;
}

TEST(Cautery, AHookWithoutCurrentLeavesTissueSoundAndAirClear) {
  auto world = build(burning_scene(0.0));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_EQ(world->organ_burns.size(), 0u);
  EXPECT_EQ(world->smoke[0].volume.particles().size(), 0u);
}

TEST(Cautery, CurrentInTheAirBurnsNothing) {
  auto scene = burning_scene(30.0);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 5e-3;
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_EQ(world->organ_burns.size(), 0u);
  EXPECT_EQ(world->smoke[0].volume.particles().size(), 0u);
}

TEST(Cautery, ABurnGrowsUnderTheTipInRestSpace) {
  auto world = build(burning_scene(30.0));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  ASSERT_EQ(world->organ_burns.size(), 1u);
  const BrickField& damage = world->organ_burns[0].damage;
  EXPECT_GT(damage.sample(Vec3(1e-3, 0, kTop)), 0.5);
  EXPECT_LT(damage.sample(Vec3(-8e-3, 0, kTop)), 0.01);
  EXPECT_LT(damage.sample(Vec3(0, 0, kTop - 8e-3)), 0.01);
}

TEST(Cautery, SmokeFollowsThePower) {
  auto weak = build(burning_scene(8.0));
  auto strong = build(burning_scene(16.0));
  ASSERT_TRUE(weak && strong);
  step_until(*weak, 0.6);
  step_until(*strong, 0.6);
  const double weak_mass = weak->smoke[0].volume.book().emitted;
  const double strong_mass = strong->smoke[0].volume.book().emitted;
  EXPECT_GT(weak_mass, 0.0);
  EXPECT_NEAR(strong_mass / weak_mass, 2.0, 0.2);
}

TEST(Cautery, SmokeMassIsTheYieldOfTheAbsorbedEnergy) {
  const auto scene = burning_scene(20.0);
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.8);
  const SmokeBody& smoke = world->smoke[0];
  EXPECT_NEAR(smoke.volume.book().emitted + smoke.emitters[0].mass_owed,
              world->organ_burns[0].energy * scene.smoke[0].smoke_yield,
              1e-6 * smoke.volume.book().emitted);
}

TEST(Cautery, SmokeOutsideEveryVolumeIsReported) {
  auto scene = burning_scene(20.0);
  scene.smoke[0].domain = Box(Vec3(0.1, 0.1, 0.1), Vec3(0.2, 0.2, 0.2));
  auto world = build(scene);
  ASSERT_TRUE(world);
  const std::uint32_t flags = step_until(*world, 0.5);
  EXPECT_TRUE(flags & static_cast<std::uint32_t>(FrameFlag::kSmokeOutside));
}

TEST(Cautery, AFullVolumeIsReported) {
  auto scene = burning_scene(40.0);
  scene.smoke[0].max_particles = 100;
  auto world = build(scene);
  ASSERT_TRUE(world);
  const std::uint32_t flags = step_until(*world, 1.0);
  EXPECT_TRUE(flags & static_cast<std::uint32_t>(FrameFlag::kSmokeFull));
  EXPECT_LE(world->smoke[0].volume.particles().size(), 100u);
}

TEST(Cautery, SkippedPartsSayWhy) {
  auto scene = burning_scene(0.0);
  const auto skipped = skipped_parts(scene, false);
  std::map<std::string, std::string> why;
  for (const SkippedReport& part : skipped) why[part.what] = part.why;
  EXPECT_TRUE(why.contains("rendering"));
  EXPECT_TRUE(why.contains("heat"));
  EXPECT_TRUE(why.contains("smoke"));
  EXPECT_TRUE(why.contains("haptics"));
  const auto burning = skipped_parts(burning_scene(20.0), true);
  for (const SkippedReport& part : burning) {
    EXPECT_NE(part.what, "heat");
    EXPECT_NE(part.what, "smoke");
  }
}

}  // namespace
}  // namespace viscera::test
