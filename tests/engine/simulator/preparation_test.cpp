// Preparation without choreography: what is prepared follows from the body, not from where tools
// will go, and what it leaves out is made when a tool comes there.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/organ/organ_cache.h"
#include "engine/run/state_hash.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

constexpr double kTop = 25e-3;        // pole of the ball [m]
constexpr std::size_t kNoBudget = 1;  // every column above the fine part's comes on demand

/// A probe over the pole, which is the fine part.
SceneDescription probed_ball() {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.organs[0].resolution.fine = {ball_region(Vec3(0, 0, kTop), 10e-3)};
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, 2e-3,
      {{0.0, Vec3(0, 0, kTop + 4e-3), 0.0, 1.0}, {0.5, Vec3(0, 0, kTop + 1e-3), 0.0, 1.0}})};
  return scene;
}

/// Its side, which the path doesn't come near, 1 mm deep.
const Vec3 kAtTheSide(kTop + 1e-3, 0, 0);

struct Built {
  std::unique_ptr<World> world;
  std::vector<std::string> warnings;
  const OrganModel& model() const { return *world->all<OrganBody>()[0].model; }
};

Built build_with(const SceneDescription& scene, PrepareOptions options) {
  options.assets = project_file("assets");
  Built built;
  auto world = build_world(scene, test_tissues(), options, no_progress(), built.warnings);
  EXPECT_TRUE(world) << world.error().text();
  if (world) built.world = std::move(*world);
  return built;
}

Built built_with_budget(const SceneDescription& scene, std::size_t budget) {
  return build_with(scene, {.assets = {}, .use_cache = false, .column_budget = budget});
}

/// Takes the probe to its side, whatever the path says; the state after some frames.
std::string press_the_side(World& world) {
  Controls controls = controls_of_paths(world, 0.0);
  controls.tools[0].tip = kAtTheSide;
  FlagSet flags;
  for (int frame = 0; frame < 6; ++frame) flags.raise(step_frame(world, controls, nullptr).flags);
  EXPECT_TRUE(flags.empty());
  EXPECT_GT(force_on(world, 0).x(), 1e-3);
  return StateHash().finish(world);
}

Result<std::string> key_of(const SceneDescription& scene) {
  const OrganDescription& organ = scene.organs[0];
  const Tissue tissue = tissue_of(organ, test_tissues());
  const auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  const PrepareOptions options{project_file("assets"), false};
  std::vector<std::string> warnings;
  const auto shape = prepare_shape(organ, options, warnings);
  if (!shape) return std::unexpected(shape.error());
  const auto demand =
      demand_on(organ, tissue, reach_of(*instruments, scene, organ), shape->surface);
  if (!demand) return std::unexpected(demand.error());
  return organ_key(organ, tissue, *shape, *demand, options);
}

void move_key_frames(SceneDescription& scene, const Vec3& by) {
  for (InstrumentKey& key : scene.instruments[0].path) key.tip += by;
}

TEST(Preparation, MovedKeyFramesAskForTheSameBodyWhereTheFinePartIsGiven) {
  auto scene = probed_ball();
  const auto key = key_of(scene);
  ASSERT_TRUE(key);
  move_key_frames(scene, Vec3(8e-3, 5e-3, 0));
  EXPECT_EQ(*key_of(scene), *key);
  scene.organs[0].resolution.fine[0].radius += 1e-3;
  EXPECT_NE(*key_of(scene), *key) << "that is another body";
}

TEST(Preparation, KeyFramesMovedALittleAskForTheSameBodyWithoutAFinePart) {
  auto scene = probed_ball();
  scene.organs[0].resolution.fine.clear();
  const auto key = key_of(scene);
  ASSERT_TRUE(key);
  move_key_frames(scene, Vec3(0.5e-3, -0.3e-3, 0.2e-3));
  EXPECT_EQ(*key_of(scene), *key);
  move_key_frames(scene, Vec3(60e-3, 0, -60e-3));
  EXPECT_NE(*key_of(scene), *key) << "a path past the side comes near other bricks";
}

TEST(Preparation, AHookWhoseBurnMovesAsksForTheSameBodyWhereTheFinePartIsGiven) {
  auto scene = probed_ball();
  scene.instruments[0].kind = InstrumentKind::kHook;
  for (InstrumentKey& key : scene.instruments[0].path) key.power = 20.0;
  const auto key = key_of(scene);
  ASSERT_TRUE(key);
  move_key_frames(scene, Vec3(6e-3, 0, 0));
  EXPECT_EQ(*key_of(scene), *key);
}

TEST(Preparation, AHeldToolReachesOrgansThatNoPathLeadsTo) {
  auto scene = probed_ball();
  move_key_frames(scene, Vec3(0, 0, 0.2));
  EXPECT_FALSE(built_with_budget(scene, kColumnBudget).model().deformable());
  scene.instruments[0].extras.set(HapticDescription());
  EXPECT_TRUE(built_with_budget(scene, kColumnBudget).model().touchable_anywhere());
}

TEST(Preparation, AToolOffItsPathFeelsWhatItWouldFeelHadItBeenAnnounced) {
  auto scene = probed_ball();
  const Built astray = built_with_budget(scene, kColumnBudget);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip = Vec3(key.tip.z(), 0, 0);
  const Built announced = built_with_budget(scene, kColumnBudget);
  ASSERT_TRUE(astray.world && announced.world);
  EXPECT_EQ(astray.model().cloud.positions, announced.model().cloud.positions);
  EXPECT_EQ(press_the_side(*astray.world), press_the_side(*announced.world));
  EXPECT_EQ(astray.model().column_figures().on_demand, 0u);
}

TEST(Preparation, ColumnsMadeOnDemandAreThoseMadeBefore) {
  auto scene = probed_ball();
  scene.organs[0].resolution.spacing = 3.5e-3;  // a dozen blocks
  scene.organs[0].resolution.finest = 3e-3;
  const Built late = built_with_budget(scene, kNoBudget);
  const Built early = built_with_budget(scene, kNoBudget);
  ASSERT_TRUE(late.world && early.world);
  early.model().compliance.need_all();
  const std::size_t prepared = late.model().column_figures().prepared;
  const std::size_t all = 3 * late.model().compliance.touchable.size();
  EXPECT_GT(prepared, 0u);
  EXPECT_LT(prepared, all);
  EXPECT_EQ(late.model().column_figures().on_demand, 0u);
  EXPECT_EQ(press_the_side(*late.world), press_the_side(*early.world));
  const ColumnFigures figures = late.model().column_figures();
  EXPECT_EQ(figures.prepared, prepared);
  EXPECT_GT(figures.on_demand, 0u);
  EXPECT_LT(figures.prepared + figures.on_demand, all) << "no more than was needed";
  EXPECT_GT(figures.on_demand_s, 0.0);
  late.model().compliance.need_all();
  EXPECT_EQ(late.model().compliance.columns, early.model().compliance.columns);
}

TEST(Preparation, ColumnsOnDemandAreThoseOfTheWholeToSinglePrecision) {
  const Built whole = built_with_budget(probed_ball(), kColumnBudget);
  const Built parts = built_with_budget(probed_ball(), kNoBudget);
  ASSERT_TRUE(whole.world && parts.world);
  parts.model().compliance.need_all();
  const auto &one = whole.model().compliance.columns, &other = parts.model().compliance.columns;
  ASSERT_EQ(one.size(), other.size());
  float greatest = 0.0f, worst = 0.0f;
  for (std::size_t i = 0; i < one.size(); ++i) {
    greatest = std::max(greatest, std::abs(one[i]));
    worst = std::max(worst, std::abs(one[i] - other[i]));
  }
  EXPECT_LT(worst, 1e-5f * greatest);
}

TEST(Preparation, SeveralThreadsThatAskAtOnceGetTheSameColumns) {
  const Built alone = built_with_budget(probed_ball(), kNoBudget);
  const Built shared = built_with_budget(probed_ball(), kNoBudget);
  ASSERT_TRUE(alone.world && shared.world);
  alone.model().compliance.need_all();
  const SurfaceCompliance& compliance = shared.model().compliance;
  const int count = static_cast<int>(compliance.touchable.size());
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      // Each in another order, so that they meet.
      for (int i = 0; i < count; ++i) {
        const int place = t % 2 == 0 ? (i + t * count / 4) % count : count - 1 - i;
        compliance.need({&place, 1});
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(compliance.columns, alone.model().compliance.columns);
  const ColumnFigures figures = shared.model().column_figures();
  EXPECT_EQ(figures.prepared + figures.on_demand, 3 * compliance.touchable.size())
      << "each was made once";
}

TEST(Preparation, AFinePartBesideTheSurfaceIsRefusedWithItsPlace) {
  auto scene = probed_ball();
  scene.organs[0].resolution.fine.push_back(ball_region(Vec3(0, 0, 0.1), 10e-3));
  std::vector<std::string> warnings;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  for (const char* word :
       {"organs/0", "\"ball\"", "resolution/fine/1", "found a sphere", "expected one that does"})
    EXPECT_NE(world.error().text().find(word), std::string::npos) << world.error().text();
}

/// A cache of its own.
class KeptFactor : public testing::Test {
 protected:
  void SetUp() override { setenv("VISCERA_CACHE", folder_.path().c_str(), 1); }
  void TearDown() override { unsetenv("VISCERA_CACHE"); }

  Built build(SceneDescription scene = probed_ball()) const {
    return build_with(scene, {.assets = {}, .use_cache = true, .column_budget = kNoBudget});
  }
  fs::path factor_file() const {
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      if (entry.path().extension() == ".factor") return entry.path();
    return {};
  }
  /// Built anew with a warning that says this, and the same bits; then the cache serves again.
  void expect_rebuilt(const std::string& reason, const std::string& state) const {
    const Built again = build();
    ASSERT_TRUE(again.world);
    EXPECT_FALSE(again.model().cache_hit);
    ASSERT_EQ(again.warnings.size(), 1u);
    EXPECT_NE(again.warnings[0].find("rebuilt because " + reason), std::string::npos)
        << again.warnings[0];
    EXPECT_EQ(press_the_side(*again.world), state);
    const Built after = build();
    ASSERT_TRUE(after.world);
    EXPECT_TRUE(after.model().cache_hit);
    EXPECT_TRUE(after.warnings.empty());
  }

  const TemporaryFolder folder_;
};

TEST_F(KeptFactor, ServesASecondRunToTheSameBits) {
  const Built first = build();
  ASSERT_TRUE(first.world);
  EXPECT_FALSE(first.model().cache_hit);
  ASSERT_FALSE(factor_file().empty());
  auto scene = probed_ball();
  move_key_frames(scene, Vec3(5e-3, 0, 0));
  const Built second = build(scene);
  ASSERT_TRUE(second.world);
  EXPECT_TRUE(second.model().cache_hit) << "a moved key frame is no other body";
  EXPECT_EQ(second.model().column_figures().prepared, first.model().column_figures().prepared);
  EXPECT_EQ(second.model().column_figures().on_demand, 0u);
  first.model().compliance.need_all();
  second.model().compliance.need_all();
  EXPECT_EQ(second.model().compliance.columns, first.model().compliance.columns);
}

TEST_F(KeptFactor, TruncatedIsRefusedAndMadeAgain) {
  const Built first = build();
  ASSERT_TRUE(first.world);
  fs::resize_file(factor_file(), fs::file_size(factor_file()) / 2);
  expect_rebuilt("it is truncated or damaged", press_the_side(*first.world));
}

TEST_F(KeptFactor, MissingIsMadeAgain) {
  const Built first = build();
  ASSERT_TRUE(first.world);
  fs::remove(factor_file());
  expect_rebuilt("there is no such file", press_the_side(*first.world));
}

TEST_F(KeptFactor, OfAnotherOrganIsRefusedAndMadeAgain) {
  const Built first = build();
  ASSERT_TRUE(first.world);
  const fs::path own = factor_file(), put_aside = folder_ / "own";
  fs::rename(own, put_aside);
  auto other = probed_ball();
  other.organs[0].youngs_modulus = 20e3;
  ASSERT_TRUE(build(other).world);
  fs::rename(factor_file(), own);
  fs::remove(put_aside);
  expect_rebuilt("it was made for other inputs", press_the_side(*first.world));
}

}  // namespace
}  // namespace viscera::test
