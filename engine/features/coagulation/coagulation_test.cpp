#include "engine/features/coagulation/coagulation.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/features/gravity/gravity.h"
#include "engine/run/run.h"
#include "engine/run/state_hash.h"
#include "engine/simulator/build.h"
#include "tests/support/baselines.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;

/// A hook burns the pole of a ball for a second with `power` [W] and leaves; a ball tip then
/// presses there.
SceneDescription burn_and_press(double power) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.organs[0].resolution.fine = {ball_region(Vec3(0, 0, kTop), 10e-3)};
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kTop + 3e-3), 0.0, 1.0},
                                      {0.2, Vec3(0, 0, kTop + 0.2e-3), power, 1.0},
                                      {1.2, Vec3(0, 0, kTop + 0.0e-3), 0.0, 1.0},
                                      {1.4, Vec3(0, 0, kTop + 30e-3), 0.0, 1.0}}),
                       straight_tool("probe", InstrumentKind::kProbe, 2e-3,
                                     {{0.0, Vec3(0, 0, kTop + 60e-3), 0.0, 1.0},
                                      {2.0, Vec3(0, 0, kTop + 20e-3), 0.0, 1.0},
                                      {2.2, Vec3(0, 0, kTop + 0.5e-3), 0.0, 1.0},
                                      {3.0, Vec3(0, 0, kTop + 0.5e-3), 0.0, 1.0}})};
  return scene;
}

TEST(TissueChanges, ABurntPlaceSinksAndIsStiffer) {
  auto scene = burn_and_press(30.0);
  auto world = build(scene);
  scene.organs[0].extras.set(NeverStiffens());
  auto soft = build(scene);
  ASSERT_TRUE(world && soft);
  step_until(*world, 1.9);
  step_until(*soft, 1.9);
  ASSERT_EQ(world->all<OrganChange>().size(), 1u);
  const OrganChange& change = world->all<OrganChange>()[0];
  const std::shared_ptr<const StiffnessUpdate> update = world->all<OrganUpdate>()[0].update;
  ASSERT_TRUE(update);
  std::printf(
      "updates %ld, nodes %zu, rank %zu, factor %.2f, stiffened %.1f mm3, left out %.2f mm3, "
      "shrunk %.3f mm\n",
      static_cast<long>(change.updates), update->nodes, update->rank, update->greatest_stiffness,
      1e9 * change.stiffened, 1e9 * change.left_out, 1e3 * update->greatest_shift);
  const auto told = stiffening_of(*world, world->all<OrganBody>().owner(0));
  ASSERT_TRUE(told);
  EXPECT_EQ(told->updates, change.updates);
  EXPECT_EQ(told->greatest_factor, update->greatest_stiffness);
  const Json tissue = Json::parse(coagulation_report(*world).front().json);
  EXPECT_EQ(tissue[0]["stiffening"]["rank"], update->rank);
  EXPECT_EQ(tissue[0]["stiffening"]["volume_stiffened_m3"], change.stiffened);
  EXPECT_GT(change.updates, 1);
  EXPECT_GT(change.stiffened, 1e-9);
  EXPECT_EQ(change.left_out, 0.0);
  EXPECT_GT(update->greatest_stiffness, 1.5);
  // Nothing touches it, and yet it has a dimple.
  EXPECT_GT(world->all<OrganState>()[0].greatest_displacement, 10e-6);
  EXPECT_EQ(soft->all<OrganState>()[0].greatest_displacement, 0.0);
  EXPECT_EQ(soft->all<OrganChange>().size(), 0u);

  // The probe meets a little less tissue where it has sunk, and yet more force.
  step_until(*world, 2.5);
  step_until(*soft, 2.5);
  const double stiff = force_on(*world, 1).z(), before = force_on(*soft, 1).z();
  std::printf("force %.4f N, without %.4f N\n", stiff, before);
  EXPECT_GT(before, 1e-3);
  EXPECT_GT(stiff, 1.1 * before);
}

TEST(TissueChanges, TissueAtFiniteStrainSinksAndStiffensAsLinearTissueDoes) {
  // A slight burn; how the law follows small changes exactly stands in finite_body_test.
  auto scene = burn_and_press(3.0);
  auto linear = build(scene);
  scene.organs[0].response = Response::kFinite;
  auto finite = build(scene);
  scene.organs[0].extras.set(NeverStiffens());
  auto soft = build(scene);
  ASSERT_TRUE(linear && finite && soft);
  for (World* world : {linear.get(), finite.get(), soft.get()}) step_until(*world, 1.9);
  EXPECT_GT(finite->all<OrganChange>()[0].updates, 1);
  const double sunk = linear->all<OrganState>()[0].greatest_displacement;
  EXPECT_NEAR(finite->all<OrganState>()[0].greatest_displacement / sunk, 1.0, 0.2);
  EXPECT_LT(soft->all<OrganState>()[0].greatest_displacement, 0.1 * sunk);
  for (World* world : {linear.get(), finite.get(), soft.get()}) step_until(*world, 2.6);
  const double force = force_on(*linear, 1).z(), before = force_on(*soft, 1).z();
  std::printf("sunk %.4f and %.4f mm, force %.4f and %.4f N, without %.4f N\n", 1e3 * sunk,
              1e3 * finite->all<OrganState>()[0].greatest_displacement, force,
              force_on(*finite, 1).z(), before);
  EXPECT_NEAR(force_on(*finite, 1).z() / force, 1.0, 0.1);
  EXPECT_GT(force_on(*finite, 1).z(), 1.1 * before);
}

TEST(TissueChanges, WithoutCurrentNothingIsPreparedOrKept) {
  auto world = build(burn_and_press(0.0));
  ASSERT_TRUE(world);
  EXPECT_TRUE(world->all<OrganBody>()[0].model->changeable.empty());
  step_until(*world, 1.0);
  EXPECT_EQ(world->all<OrganChange>().size(), 0u);
  EXPECT_EQ(world->all<FreeShape>().size(), 0u);
}

TEST(TissueChanges, TheSameForAnyNumberOfThreads) {
  const auto hash = [] {
    auto world = build(burn_and_press(30.0));
    step_until(*world, 2.4);
    EXPECT_GT(world->all<OrganChange>()[0].updates, 0);
    return StateHash().finish(*world);
  };
  const std::string many = hash();
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(hash(), many);
}

TEST(TissueChanges, HalfPrecisionFollowsToo) {
  auto scene = burn_and_press(30.0);
  auto single = build(scene);
  scene.organs[0].displacement_storage = DisplacementStorage::kHalf;
  auto half = build(scene);
  ASSERT_TRUE(single && half);
  step_until(*single, 2.5);
  step_until(*half, 2.5);
  const auto& one = single->all<OrganState>()[0].positions;
  const auto& other = half->all<OrganState>()[0].positions;
  ASSERT_TRUE(single->all<OrganState>()[0].pressed);
  float worst = 0.0f;
  for (std::size_t v = 0; v < one.size(); ++v) worst = std::max(worst, (one[v] - other[v]).norm());
  EXPECT_LT(worst, 2e-3 * single->all<OrganState>()[0].greatest_displacement);
}

TEST(TissueChanges, FormulationsThatCantFollowSaySo) {
  if (!strong_forms_built_in()) GTEST_SKIP() << kNoStrongForms;
  auto scene = burn_and_press(30.0);
  scene.organs[0].formulation = "gfdm";
  std::vector<std::string> warnings;
  auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_TRUE(world) << world.error().text();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("galerkin"), std::string::npos) << warnings[0];
  step_until(**world, 1.5);
  EXPECT_EQ((*world)->all<OrganChange>().size(), 0u);
}

/// Prepared without the cache and from it; both for 1.6 s come to the same bits.
struct FreshAndCached {
  explicit FreshAndCached(const SceneDescription& scene) {
    const TemporaryFolder folder;
    setenv("VISCERA_CACHE", folder.path().c_str(), 1);
    std::vector<std::string> warnings;
    const auto make = [&] {
      return build_world(scene, test_tissues(), {project_file("assets"), true}, no_progress(),
                         warnings);
    };
    auto one = make(), other = make();
    unsetenv("VISCERA_CACHE");
    if (!one || !other) return;
    fresh = std::move(*one);
    cached = std::move(*other);
    EXPECT_FALSE(model(*fresh).cache_hit);
    EXPECT_TRUE(model(*cached).cache_hit);
    EXPECT_FALSE(model(*fresh).changeable.empty());
    for (World* world : {fresh.get(), cached.get()}) step_until(*world, 1.6);
    EXPECT_GT(fresh->all<OrganChange>()[0].updates, 0);
    EXPECT_EQ(StateHash().finish(*fresh), StateHash().finish(*cached));
  }
  static const OrganModel& model(const World& world) { return *world.all<OrganBody>()[0].model; }
  std::unique_ptr<World> fresh, cached;
};

TEST(TissueChanges, TheCacheKeepsWhatMayChange) {
  const FreshAndCached both(burn_and_press(30.0));
  ASSERT_TRUE(both.fresh && both.cached);
  const ChangeableRegion& one = both.model(*both.fresh).changeable;
  const ChangeableRegion& other = both.model(*both.cached).changeable;
  EXPECT_EQ(one.nodes, other.nodes);
  EXPECT_EQ(one.places, other.places);
  EXPECT_EQ(one.tissue.cell_begin, other.tissue.cell_begin);
  EXPECT_EQ(one.memory_bytes(), other.memory_bytes());
}

TEST(TissueChanges, TheCacheKeepsWhatMayChangeAtFiniteStrain) {
  auto scene = burn_and_press(30.0);
  scene.organs[0].response = Response::kFinite;
  const FreshAndCached both(scene);
  ASSERT_TRUE(both.fresh && both.cached);
  EXPECT_EQ(both.model(*both.fresh).changeable.tissue.positions,
            both.model(*both.cached).changeable.tissue.positions);
}

}  // namespace
}  // namespace viscera::test
