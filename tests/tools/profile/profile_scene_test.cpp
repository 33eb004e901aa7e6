// The berths in which `viscera profile` places a scene's organs, and what idle ones cost.
#include "tools/profile/profile_scene.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace {
std::atomic<std::size_t> allocations = 0;
}  // namespace

// NOLINTBEGIN: counts what the whole program allocates.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
// NOLINTEND

namespace viscera::test {
namespace {

/// A ball of 25 mm that a probe presses 3 mm deep from 0.1 s on.
SceneDescription pressed_ball() {
  SceneDescription scene = soft_ball_scene(12e-3, 6e-3);
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, 3e-3,
      {{0.0, Vec3(0.0, 0.0, 30e-3), 0.0, 1.0}, {0.1, Vec3(0.0, 0.0, 25e-3), 0.0, 1.0}})};
  return scene;
}

class Profile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto instruments = make_instruments(scene());
    ASSERT_TRUE(instruments);
    std::vector<std::string> warnings;
    auto prepared =
        prepare_organs(scene(), *instruments, test_tissues(), {"", false}, no_progress(), warnings);
    ASSERT_TRUE(prepared) << prepared.error().text();
    models() = *prepared;
    berths() = {{0}, occupied_by(scene(), *instruments, models())};
  }
  static SceneDescription& scene() {
    static SceneDescription shared = pressed_ball();
    return shared;
  }
  static OrganModels& models() {
    static OrganModels shared;
    return shared;
  }
  static Berths& berths() {
    static Berths shared;
    return shared;
  }
  static std::unique_ptr<World> filled(const Occupancy& wanted) {
    const SceneDescription many = fill_berths(scene(), berths(), wanted);
    auto instruments = make_instruments(many);
    if (!instruments) return nullptr;
    auto placed = place_entities(many, std::move(*instruments),
                                 models_of(models(), berths(), wanted.organs), test_tissues());
    EXPECT_TRUE(placed) << placed.error().text();
    return std::move(*placed);
  }
};

TEST_F(Profile, InstancesOfAnOrganShareItsModel) {
  const auto world = filled({20, 1, 1});
  ASSERT_EQ(world->all<OrganBody>().size(), 20u);
  for (const OrganBody& organ : world->all<OrganBody>())
    EXPECT_EQ(organ.model.get(), models()[0].get());
}

TEST_F(Profile, OrgansStandApartUnderNamesOfTheirOwn) {
  const SceneDescription many = fill_berths(scene(), berths(), {20, 3, 3});
  for (std::size_t i = 0; i < many.organs.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3 apart = many.organs[i].pose.position - many.organs[j].pose.position;
      EXPECT_GT(apart.norm(), 50e-3 + 49e-3);
      EXPECT_NE(many.organs[i].name, many.organs[j].name);
    }
  ASSERT_EQ(many.instruments.size(), 3u);
  EXPECT_NE(many.instruments[0].name, many.instruments[2].name);
}

TEST_F(Profile, OnlyTouchedOrgansDeformAndEachAnswersAsInTheScene) {
  const auto alone = build(scene());
  const auto world = filled({20, 10, 10});
  step_until(*alone, 0.2);
  step_until(*world, 0.2);
  const double force = force_on(*alone, 0).norm();
  ASSERT_GT(force, 0.0);
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_NEAR(force_on(*world, i).norm(), force, 1e-6 * force) << i;
  for (std::size_t o = 0; o < 20; ++o) EXPECT_EQ(world->all<OrganState>()[o].deformed, o < 10) << o;
}

TEST_F(Profile, ToolsThatAreToTouchNothingTouchNothing) {
  for (const std::size_t organs : {1u, 8u, 9u, 32u}) {
    const auto world = filled({organs, 0, 2});
    ASSERT_EQ(world->all<InstrumentBody>().size(), 2u);
    step_until(*world, 0.2);
    for (const OrganState& state : world->all<OrganState>()) EXPECT_EQ(state.version, 0u);
  }
}

TEST_F(Profile, AFrameOfIdleOrgansAllocatesNothing) {
  const auto world = filled({32, 0, 1});
  Trace trace(stage_names());
  trace.reserve(1000);
  step_frame(*world, trace);
  const std::size_t before = allocations;
  for (int frame = 0; frame < 30; ++frame) step_frame(*world, trace);
  EXPECT_EQ(allocations - before, 0u);
}

TEST_F(Profile, IdleOrgansAddNoAllocationsToATouchedOne) {
  std::vector<std::size_t> counts;
  for (const std::size_t organs : {1u, 32u}) {
    const auto world = filled({organs, 1, 1});
    step_until(*world, 0.15);
    Trace trace(stage_names());
    trace.reserve(1000);
    const std::size_t before = allocations;
    for (int frame = 0; frame < 10; ++frame) step_frame(*world, trace);
    counts.push_back(allocations - before);
  }
  EXPECT_EQ(counts[1], counts[0]);
}

}  // namespace
}  // namespace viscera::test
