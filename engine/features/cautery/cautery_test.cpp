#include "engine/features/cautery/cautery.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/features/cautery/heat_setup.h"
#include "engine/features/coagulation/coagulation_keys.h"
#include "engine/features/gas/gas.h"
#include "engine/features/gas/gas_keys.h"
#include "engine/features/smoke/smoke.h"
#include "engine/gpu/backend.h"
#include "engine/run/run.h"
#include "engine/simulator/build.h"
#include "engine/verification/heat_case.h"
#include "tests/support/paths.h"
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
  scene.extras.set(SmokeDescriptions{smoke});
  return scene;
}

TEST(Cautery, AHookWithoutCurrentLeavesTissueSoundAndAirClear) {
  auto world = build(burning_scene(0.0));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_EQ(world->all<OrganBurn>().size(), 0u) << "it can't burn anything";
  EXPECT_EQ(world->all<SmokeBody>()[0].volume.particles().size(), 0u);
}

TEST(Cautery, CurrentInTheAirBurnsNothing) {
  auto scene = burning_scene(30.0);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 5e-3;
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  ASSERT_EQ(world->all<OrganBurn>().size(), 1u);
  EXPECT_EQ(world->all<OrganBurn>()[0].heat.bricks().count(), 0u) << "a cold organ costs nothing";
  EXPECT_EQ(world->all<OrganBurn>()[0].heat.book().delivered, 0.0);
  EXPECT_TRUE(world->all<BurnTrace>()[0].current.open);
  EXPECT_EQ(world->all<SmokeBody>()[0].volume.particles().size(), 0u);
}

TEST(Cautery, AnOrganFarFromEveryPathIsNotFollowed) {
  auto scene = burning_scene(30.0);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 50e-3;
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(world->all<OrganBurn>().size(), 0u);
}

TEST(Cautery, ABurnGrowsUnderTheTipInRestSpace) {
  auto world = build(burning_scene(30.0));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  ASSERT_EQ(world->all<OrganBurn>().size(), 1u);
  const HeatBricks& bricks = world->all<OrganBurn>()[0].heat.bricks();
  EXPECT_GT(bricks.coagulation_at(bricks.voxel_of(Vec3(1e-3, 0, kTop - 0.8e-3))), 1.0);
  EXPECT_EQ(bricks.dose_at(bricks.voxel_of(Vec3(-8e-3, 0, kTop - 2e-3))), 0.0);
  EXPECT_LT(bricks.dose_at(bricks.voxel_of(Vec3(0, 0, kTop - 8e-3))), 0.01);
  EXPECT_GT(world->all<OrganBurn>()[0].greatest_hot, 1e-9);
}

TEST(Cautery, TheTipGivesThePowerThatItsGeneratorIsSetTo) {
  auto world = build(burning_scene(10.0));
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  const CurrentReport& current = world->all<BurnTrace>()[0].current;
  EXPECT_NEAR(current.generated(), 10.0, 0.01);
  EXPECT_GT(current.radius, 0.2e-3);
  EXPECT_LT(current.radius, 1.1e-3) << "the tip is a millimetre";
}

TEST(Cautery, EnergyIsBooked) {
  auto world = build(burning_scene(30.0));
  ASSERT_TRUE(world);
  step_until(*world, 1.2);
  const HeatBook book = world->all<OrganBurn>()[0].heat.book();
  EXPECT_GT(book.delivered, 5.0);
  EXPECT_LT(book.delivered, 30.0 * 1.2);
  EXPECT_LT(std::abs(book.residual()), 1e-3 * book.delivered);
}

TEST(Cautery, FulgurateSparksOverAGapThatCutDoesNot) {
  auto scene = burning_scene(30.0);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip = Vec3(0, 0, kTop + 1.5e-3);
  scene.instruments[0].extras.set(CurrentMode::kFulgurate);
  auto sparks = build(scene);
  scene.instruments[0].extras.set(CurrentMode::kCut);
  auto none = build(scene);
  ASSERT_TRUE(sparks && none);
  step_until(*sparks, 0.5);
  step_until(*none, 0.5);
  EXPECT_TRUE(sparks->all<BurnTrace>()[0].current.sparks);
  EXPECT_GT(sparks->all<OrganBurn>()[0].heat.greatest_excess(), 20.0);
  EXPECT_EQ(none->all<OrganBurn>()[0].heat.greatest_excess(), 0.0);
}

TEST(Cautery, ATissueWithoutThermalValuesStaysColdAndIsNamed) {
  auto tissues = test_tissues();
  tissues.at("rubber").thermal.reset();
  tissues.at("rubber").thermal_lacks = {"specific_heat", "perfusion"};
  std::vector<std::string> warnings;
  auto world = build_world(burning_scene(30.0), tissues, {project_file("assets"), false},
                           no_progress(), warnings);
  ASSERT_TRUE(world) << world.error().text();
  const FlagSet flags = step_until(**world, 0.6);
  EXPECT_EQ((*world)->all<OrganBurn>().size(), 0u);
  EXPECT_TRUE(flags.has(kNotHeated));
  ASSERT_FALSE(warnings.empty());
  for (const char* part : {"rubber", "specific_heat, perfusion", "tissues.json"})
    EXPECT_NE(warnings.back().find(part), std::string::npos) << warnings.back();
}

TEST(Cautery, AnElectrodeThatCannotBeIsRefused) {
  auto scene = burning_scene(30.0);
  scene.instruments[0].tip.radius = 20e-3;
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 30e-3;
  std::vector<std::string> warnings;
  scene.instruments[0].path[1].power = 4500.0;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("power"), std::string::npos) << world.error().text();
  EXPECT_NE(world.error().text().find("radius of the tip"), std::string::npos);
}

TEST(Cautery, AVoxelTooFineForTheMachineIsRefusedWithItsSize) {
  auto scene = burning_scene(30.0);
  scene.extras.get<HeatDescription>().voxel = 5e-6;
  std::vector<std::string> warnings;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("heat/voxel_mm: found 0.005"), std::string::npos)
      << world.error().text();
}

TEST(Cautery, SmokeIsTheYieldOfWhatVaporised) {
  auto world = build(burning_scene(20.0));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  const SmokeBody& smoke = world->all<SmokeBody>()[0];
  const Bioheat& heat = world->all<OrganBurn>()[0].heat;
  const double emitted = smoke.volume.book().emitted + smoke.debts[0].mass_owed;
  EXPECT_GT(emitted, 0.0);
  EXPECT_NEAR(emitted, world->all<OrganBurn>()[0].smoke, 1e-6 * emitted);
  EXPECT_NEAR(emitted,
              heat.tissue().smoke_yield * (heat.vaporised_water() + heat.vaporised_tissue()),
              1e-3 * emitted);
}

TEST(Cautery, ASpatulaBurnsAsWideAsItTouches) {
  auto scene = burning_scene(30.0);
  auto narrow = build(scene);
  scene.instruments[0].kind = InstrumentKind::kSpatula;
  scene.instruments[0].tip.radius = 2.5e-3;
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 1.5e-3;
  auto wide = build(scene);
  ASSERT_TRUE(narrow && wide);
  step_until(*narrow, 0.6);
  step_until(*wide, 0.6);
  EXPECT_GT(wide->all<BurnTrace>()[0].current.power, 0.0);
  EXPECT_GT(wide->all<BurnTrace>()[0].current.radius,
            1.2 * narrow->all<BurnTrace>()[0].current.radius);
  EXPECT_LT(wide->all<OrganBurn>()[0].heat.greatest_excess(),
            narrow->all<OrganBurn>()[0].heat.greatest_excess());
}

TEST(Cautery, MorePowerSmokesMore) {
  auto weak = build(burning_scene(8.0));
  auto strong = build(burning_scene(30.0));
  ASSERT_TRUE(weak && strong);
  step_until(*weak, 1.0);
  step_until(*strong, 1.0);
  EXPECT_GT(strong->all<OrganBurn>()[0].smoke, 2.0 * weak->all<OrganBurn>()[0].smoke);
}

TEST(Cautery, SmokeIsAsWarmAsTheGasThatSteamHeats) {
  auto world = build(burning_scene(30.0));
  ASSERT_TRUE(world);
  double time = 0.0;
  while (world->all<SmokeBody>()[0].volume.particles().size() == 0 && time < 1.2)
    step_until(*world, time += 1.0 / 60.0);
  step_until(*world, time += 2.0 / 60.0);
  const SmokeParticles& particles = world->all<SmokeBody>()[0].volume.particles();
  ASSERT_GT(particles.size(), 0u);
  const GasDescription& gas = gas_of(world->model().scene());
  const SmokeBody& smoke = world->all<SmokeBody>()[0];
  const JetDrag drag = jet_drag(smoke.volume.parameters());
  const Vec3 origin = world->all<SmokeSource>()[0].description.domain.min();
  double most = 0.0, farthest = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3 from = particles.position(i).cast<double>() + origin - Vec3(0, 0, kTop);
    most = std::max<double>(most, particles.temperature(i));
    farthest = std::max(farthest, from.norm());
    EXPECT_GT(from.z(), -1e-3);
    // A jet comes out of the tissue no faster than sound goes in steam, and its drag holds it back.
    EXPECT_LT(from.norm(), drag.way_after(473.0, particles.age(i)));
  }
  // The warmest of it is warmer than if what heat the gas has were spread over half a ball as wide.
  const double held = world->one<GasBody>()->grid->stored().heat;
  const double half_ball = 2.0 / 3.0 * std::numbers::pi * std::pow(farthest, 3);
  EXPECT_GT(held, 0.0);
  EXPECT_GT(most, held / (gas.mixture().heat_of(1.0) * half_ball));
  EXPECT_LT(most, 10.0 * (373.15 - gas.temperature));
}

TEST(Cautery, SmokeOutsideEveryVolumeIsReported) {
  auto scene = burning_scene(20.0);
  scene.extras.get<SmokeDescriptions>()[0].domain = Box(Vec3(0.1, 0.1, 0.1), Vec3(0.2, 0.2, 0.2));
  auto world = build(scene);
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, 0.5);
  EXPECT_TRUE(flags.has(kSmokeOutside));
}

TEST(Cautery, AFullVolumeIsReported) {
  auto scene = burning_scene(40.0);
  scene.extras.get<SmokeDescriptions>()[0].max_particles = 100;
  auto world = build(scene);
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, 1.0);
  EXPECT_TRUE(flags.has(kSmokeFull));
  EXPECT_LE(world->all<SmokeBody>()[0].volume.particles().size(), 100u);
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

/// A burn that contact doesn't follow: tissue that stiffens and shrinks moves under the tip by what
/// the kernels' rounding leaves, and the spark with it, so that twins part.
SceneDescription twin_scene() {
  auto scene = burning_scene(30.0);
  scene.organs[0].extras.set(NeverStiffens());
  return scene;
}

// A voxel that can take no more heat is full to the last bit: were a sum's rounding to say whether
// it still conducts, current would take another way, and harm differ by a hundred times as much.
TEST(Cautery, PowerThatDiffersInTheEighthDigitBurnsTheSame) {
  auto scene = twin_scene();
  auto one = build(scene);
  for (InstrumentKey& key : scene.instruments[0].path) key.power *= 1.0 + 6e-8;
  auto other = build(scene);
  ASSERT_TRUE(one && other);
  step_until(*one, 1.0);
  step_until(*other, 1.0);
  const HeatDifference apart =
      heat_difference(one->all<OrganBurn>()[0].heat, other->all<OrganBurn>()[0].heat);
  ASSERT_TRUE(apart.same_bricks);
  EXPECT_LT(apart.excess, 5e-6);
  EXPECT_LT(apart.water, 5e-6);
  EXPECT_LT(apart.damage, 1e-4);
}

/// The same scene, its heat once on the CPU and once by the compute kernels.
class CauteryOnTheGpu : public testing::Test {
 protected:
  void SetUp() override {
    auto device = open_compute_device(Backend::kGpu, false);
    if (!device) GTEST_SKIP() << device.error().text();
    context_ = device->context;
    RecordProperty("device", context_->device());
  }

  std::unique_ptr<World> build_on_gpu(const SceneDescription& scene, std::size_t organs) {
    auto world = build(scene);
    if (!world) return nullptr;
    const auto moved = move_heat_to_gpu(*world, context_);
    EXPECT_TRUE(moved) << moved.error().text();
    EXPECT_EQ(moved.value_or(0), organs);
    return world;
  }

  /// Contact is the same to the bit, so what is apart comes from the kernels' rounding and from
  /// currents that follow what they dried.
  void expect_the_same_burns(const World& cpu, const World& gpu) {
    ASSERT_EQ(cpu.all<OrganBurn>().size(), gpu.all<OrganBurn>().size());
    for (std::size_t b = 0; b < cpu.all<OrganBurn>().size(); ++b) {
      SCOPED_TRACE(b);
      const OrganBurn &one = cpu.all<OrganBurn>()[b], &other = gpu.all<OrganBurn>()[b];
      const HeatDifference apart = heat_difference(one.heat, other.heat);
      ASSERT_TRUE(apart.same_bricks);
      record("excess_apart", apart.excess);
      record("water_apart", apart.water);
      record("charred_apart", apart.charred);
      record("damage_apart", apart.damage);
      EXPECT_LT(apart.excess, 5e-5);
      EXPECT_LT(apart.water, 5e-5);
      EXPECT_LT(apart.charred, 5e-4);
      EXPECT_LT(apart.damage, 1e-3) << "it grows exponentially with temperature";
      const HeatBook book = one.heat.book(), twin = other.heat.book();
      EXPECT_GT(book.delivered, 1.0);
      EXPECT_NEAR(twin.delivered, book.delivered, 1e-5 * book.delivered);
      EXPECT_NEAR(twin.stored, book.stored, 1e-5 * book.delivered);
      EXPECT_LT(std::abs(twin.residual()), 1e-3 * book.delivered);
      EXPECT_GT(one.smoke, 0.0);
      EXPECT_NEAR(other.smoke, one.smoke, 1e-4 * one.smoke);
      EXPECT_NEAR(other.greatest_hot, one.greatest_hot, 1e-2 * one.greatest_hot);
    }
  }

  void record(const char* name, double value) {
    RecordProperty(name, std::to_string(1e6 * value) + "e-6");
  }

  std::shared_ptr<EglContext> context_;
};

TEST_F(CauteryOnTheGpu, TemperaturesWaterDamageAndSmokeAreTheCpus) {
  const auto scene = twin_scene();
  auto cpu = build(scene), gpu = build_on_gpu(scene, 1);
  ASSERT_TRUE(cpu && gpu);
  EXPECT_EQ(step_until(*gpu, 1.0), step_until(*cpu, 1.0));
  const Bioheat& heat = gpu->all<OrganBurn>()[0].heat;
  EXPECT_NE(heat.device(), nullptr);
  EXPECT_EQ(heat.device_failure(), "");
  EXPECT_GT(heat.vaporised_water(), 0.0);
  expect_the_same_burns(*cpu, *gpu);
}

TEST_F(CauteryOnTheGpu, OrgansBurnBesideEachOther) {
  auto scene = twin_scene();
  scene.organs.push_back(scene.organs[0]);
  scene.organs[1].name = "other";
  const Vec3 beside(80e-3, 0, 0);
  scene.organs[1].pose.position += beside;
  scene.instruments.push_back(scene.instruments[0]);
  scene.instruments[1].name = "other hook";
  for (InstrumentKey& key : scene.instruments[1].path) {
    key.tip += beside;
    key.power *= 0.5;
  }
  auto cpu = build(scene), gpu = build_on_gpu(scene, 2);
  ASSERT_TRUE(cpu && gpu);
  EXPECT_EQ(step_until(*gpu, 0.5), step_until(*cpu, 0.5));
  EXPECT_NE(gpu->all<OrganBurn>()[0].heat.device(), gpu->all<OrganBurn>()[1].heat.device());
  expect_the_same_burns(*cpu, *gpu);
}

TEST_F(CauteryOnTheGpu, AfterALostContextTheBurnGoesOnOnTheCpuWithoutAStepLost) {
  const auto scene = twin_scene();
  auto cpu = build(scene), gpu = build_on_gpu(scene, 1);
  ASSERT_TRUE(cpu && gpu);
  step_until(*gpu, 0.4);
  EXPECT_NE(gpu->all<OrganBurn>()[0].heat.device(), nullptr);
  context_->declare_lost();
  EXPECT_EQ(step_until(*gpu, 0.8), step_until(*cpu, 0.8));
  const Bioheat& heat = gpu->all<OrganBurn>()[0].heat;
  EXPECT_EQ(heat.device(), nullptr);
  EXPECT_EQ(heat.device_failure(), "heat on the GPU: its context was lost");
  expect_the_same_burns(*cpu, *gpu);
}

TEST_F(CauteryOnTheGpu, WhereNothingCanBurnNothingGoesThere) {
  EXPECT_TRUE(build_on_gpu(burning_scene(0.0), 0));
}

}  // namespace
}  // namespace viscera::test
