// Clips on a bar that hangs from its left end: they squeeze it, go where it goes, and close ducts.
#include "engine/features/clips/clips.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/clips/clips_flags.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "tests/support/cutting.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kClippedBar(40e-3, 8e-3, 7e-3);     // about the origin [m]
constexpr double kApplied = 0.2, kShut = 0.5;  // [s]

/// Bars along y about the bar, at this place of x; it closes at kApplied and opens again.
InstrumentDescription applier_at(double x, const ClipsDescription& clips = {.length = 11e-3,
                                                                            .opening = 10e-3}) {
  const Vec3 tip(x, 0.5 * clips.length, 0.0);
  InstrumentDescription tool = straight_tool("applier", InstrumentKind::kClipApplier, 1e-3,
                                             {{0.0, tip - Vec3(0, 25e-3, 0), 0.0, 1.0},
                                              {0.1, tip, 0.0, 1.0},
                                              {kApplied, tip, 0.0, 0.0},
                                              {0.3, tip, 0.0, 1.0}});
  tool.trocar = tip - Vec3(0.0, 0.2, 0.0);
  tool.extras.set(clips);
  return tool;
}

SceneDescription clipped_bar(double x = 0.0) {
  SceneDescription scene = held_bar_scene(kClippedBar, 1.5e-3, 0.1e-3, 2.4e-3, 2.4e-3);
  scene.organs[0].response = Response::kFinite;
  scene.instruments = {applier_at(x)};
  return scene;
}

/// What keeps the scene from being built.
std::string mistake(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  const auto model =
      build_model(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  return model ? "none" : model.error().text();
}

const Clip& only_clip(const World& world) {
  return world.all<AppliedClips>()[0].clips.at(0);
}

/// What the clip's cells do to the tissue, and where it is as the tissue's rest shape goes.
Vec3 sum_of_forces(const World& world, const Clip& clip) {
  const OrganContact& contact = *world.find<OrganContact>(clip.organ);
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < clip.cells.size(); ++k)
    sum += contact.solution.forces[clip.first + k];
  return sum;
}
/// How far the bar's surface has gone at this place of x.
Vec3 mean_displacement(const World& world, double x) {
  const OrganState& state = world.all<OrganState>()[0];
  const std::vector<Vec3f>& rest = world.all<OrganBody>()[0].model->rest_positions;
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    if (std::abs(rest[v].x() - x) > 1.5e-3) continue;
    sum += (state.positions[v] - rest[v]).cast<double>();
    ++count;
  }
  return sum / count;
}

TEST(Clips, SqueezeTissueToAThirdAndAreInBalanceWithIt) {
  const auto world = build(clipped_bar());
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 1.0), FlagSet());
  ASSERT_EQ(world->all<AppliedClips>()[0].clips.size(), 1u);
  const Clip& clip = only_clip(*world);
  EXPECT_NEAR(clip.shut, kClippedBar.z() / 3.0, 0.1e-3);
  EXPECT_DOUBLE_EQ(clip.apart, clip.shut);
  EXPECT_GT(clip.upper, 2u);
  EXPECT_GT(clip.squeeze, 0.05);
  EXPECT_LT(sum_of_forces(*world, clip).norm(), 4e-3 * clip.squeeze);
  // Bars that squeeze a bar evenly stay where they came together, but for what that shifts it from
  // its held end on.
  EXPECT_LT(std::abs(clip.pose.centre.x()), 0.5e-3);
  EXPECT_LT(clip.pose.centre.tail<2>().norm(), 0.1e-3);
  EXPECT_LT((clip.pose.axes.col(0) - Vec3(0, -1, 0)).norm(), 0.02);
}

TEST(Clips, ComeTogetherAsFastAsAHandClosesThem) {
  const auto world = build(clipped_bar());
  ASSERT_TRUE(world);
  while (world->all<AppliedClips>()[0].clips.empty()) step_until(*world, world->time() + 0.01);
  const double before = only_clip(*world).apart;
  const std::uint64_t frame = world->frame();
  step_until(*world, world->time() + 0.05);
  const auto frames = static_cast<double>(world->frame() - frame);
  EXPECT_NEAR(before - only_clip(*world).apart, 30e-3 * frames / 60.0, 0.1e-3);
}

TEST(Clips, GoWithTissueThatIsLiftedAndHoldItNowhere) {
  constexpr double kAt = 4e-3, kLift = 5e-3;
  SceneDescription lifted = clipped_bar(kAt);
  const Vec3 end(17e-3, 0, 4.7e-3);
  lifted.instruments.push_back(straight_tool("grasper", InstrumentKind::kGrasper, 1e-3,
                                             {{0.0, end, 0.0, 1.0},
                                              {0.6, end, 0.0, 1.0},
                                              {0.7, end, 0.0, 0.0},
                                              {1.2, end + Vec3(0, 0, kLift), 0.0, 0.0}}));
  SceneDescription without = lifted;
  without.instruments.erase(without.instruments.begin());
  const auto world = build(lifted), other = build(without);
  ASSERT_TRUE(world && other);
  step_until(*world, 2.0);
  step_until(*other, 2.0);
  const Clip& clip = only_clip(*world);
  EXPECT_LT(sum_of_forces(*world, clip).norm(), 4e-3 * clip.squeeze);
  const Vec3 goes = mean_displacement(*other, kAt);
  EXPECT_GT(goes.z(), 1e-3) << "the bar bends";
  EXPECT_NEAR(clip.pose.centre.z(), goes.z(), 0.1 * goes.z());
  // It turns with it, too.
  const double slope =
      (mean_displacement(*other, kAt + 3e-3) - mean_displacement(*other, kAt - 3e-3)).z() / 6e-3;
  EXPECT_NEAR(-clip.pose.axes.col(1).x() / clip.pose.axes.col(1).z(), slope, 0.25 * slope);
}

TEST(Clips, OnNothingOrWithNoneLeftAreSaid) {
  SceneDescription scene = clipped_bar();
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 15e-3;
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_TRUE(step_until(*world, 0.5).has(kClipOnNothing));
  EXPECT_TRUE(world->all<AppliedClips>()[0].clips.empty());

  scene = clipped_bar();
  const Vec3 tip = scene.instruments[0].path.back().tip;
  scene.instruments[0].path.push_back({0.5, tip, 0.0, 0.0});
  world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_TRUE(step_until(*world, 0.6).has(kNoClipLeft));
  EXPECT_EQ(world->all<AppliedClips>()[0].clips.size(), 1u);
}

TEST(Clips, AppliedFarFromEveryOrganAreRefusedWithTheirTime) {
  SceneDescription scene = clipped_bar();
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.z() += 80e-3;
  EXPECT_NE(mistake(scene).find("instruments/0/path: found a clip applied at 0."),
            std::string::npos)
      << mistake(scene);
}

TEST(Clips, ThatCantCloseOrThatHivesWouldHoldAreRefusedWithTheirPlace) {
  SceneDescription scene = clipped_bar();
  scene.instruments[0] = applier_at(0.0, {.length = 11e-3, .opening = 4e-3, .gap = 5e-3});
  EXPECT_NE(mistake(scene).find("instruments/0/clip_gap_mm: found 5"), std::string::npos)
      << mistake(scene);
  scene = clipped_bar();
  scene.organs[0].response = Response::kLocal;
  EXPECT_NE(mistake(scene).find("organs/0/response: found local"), std::string::npos)
      << mistake(scene);
}

TEST(Clips, OfAStateThatSaysWhatCantBeAreDropped) {
  const auto world = build(clipped_bar());
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  AppliedClips& applied = world->all<AppliedClips>()[0];
  ASSERT_EQ(applied.clips.size(), 1u);
  clips_feature().restored(*world);
  EXPECT_EQ(applied.clips.size(), 1u) << "what is sound stays";
  applied.clips[0].upper = 1000;
  clips_feature().restored(*world);
  EXPECT_TRUE(applied.clips.empty());
  step_until(*world, 0.4);
}

// --- ducts --------------------------------------------------------------------------------------

/// A duct along the bar, fed from its held end, that a scalpel cuts at x = 8 mm; a clip at `x`.
SceneDescription bar_to_cut(double x, double pressure, DuctDescription::Fed fed) {
  SceneDescription scene = clipped_bar(x);
  OrganDescription& bar = scene.organs[0];
  bar.extras.set(CuttableDescription{0.4e-3});
  bar.extras.set(
      DuctsDescription{{{"artery", {Vec3(-19e-3, 0, 0), Vec3(19e-3, 0, 0)}, pressure, fed}}});
  const Vec3 tip(8e-3, 12e-3, -8e-3);
  scene.instruments.push_back(
      upright_scalpel(tip, tip - Vec3(0, 24e-3, 0), 0.9, 1.1, {16e-3, 0.8e-3}));
  return scene;
}

using Fed = DuctDescription::Fed;

DuctFigures duct_after_cut(const SceneDescription& scene, bool& flagged) {
  const auto world = build(scene);
  if (!world) return {};
  EXPECT_FALSE(duct_figures(*world).at(0).cut);
  flagged = step_until(*world, 1.2).has(kDuctOpen);
  return duct_figures(*world).at(0);
}

TEST(Ducts, ThatAreCutAreClosedByAClipTowardsWhatFeedsThem) {
  bool flagged = true;
  const DuctFigures duct = duct_after_cut(bar_to_cut(0.0, 13e3, Fed::kStart), flagged);
  EXPECT_EQ(duct.name, "artery");
  EXPECT_TRUE(duct.cut);
  EXPECT_FALSE(duct.open);
  EXPECT_FALSE(flagged);
}

TEST(Ducts, StayOpenWhereAClipIsOnTheOtherSideOrHoldsLessThanTheirPressure) {
  for (const SceneDescription& scene :
       {bar_to_cut(0.0, 13e3, Fed::kEnd), bar_to_cut(0.0, 13e3, Fed::kBoth),
        bar_to_cut(15e-3, 13e3, Fed::kStart), bar_to_cut(0.0, 60e3, Fed::kStart)}) {
    bool flagged = false;
    const DuctFigures duct = duct_after_cut(scene, flagged);
    EXPECT_TRUE(duct.cut);
    EXPECT_TRUE(duct.open);
    EXPECT_TRUE(flagged);
  }
}

TEST(Ducts, StayOpenWhereShortBarsPassThemBy) {
  SceneDescription scene = bar_to_cut(0.0, 13e3, Fed::kStart);
  scene.instruments[0] = applier_at(0.0, {.length = 4e-3, .opening = 10e-3});
  scene.organs[0].extras.set(DuctsDescription{
      {{"artery", {Vec3(-19e-3, 3e-3, 0), Vec3(19e-3, 3e-3, 0)}, 13e3, Fed::kStart}}});
  bool flagged = false;
  const DuctFigures duct = duct_after_cut(scene, flagged);
  EXPECT_TRUE(duct.cut);
  EXPECT_TRUE(duct.open);
}

TEST(Ducts, OutsideOfTheirOrganAreRefusedWithTheirPlace) {
  SceneDescription scene = bar_to_cut(0.0, 13e3, Fed::kStart);
  scene.organs[0].extras.set(
      DuctsDescription{{{"artery", {Vec3(-19e-3, 0, 0), Vec3(30e-3, 0, 0)}, 13e3, Fed::kStart}}});
  EXPECT_NE(mistake(scene).find("organs/0/ducts/0/through/1/point_mm"), std::string::npos)
      << mistake(scene);
}

TEST(Clips, HoldTheStumpOfABodyThatIsCutAndFallWhereTheirTissueIsGone) {
  const auto world = build(bar_to_cut(0.0, 13e3, Fed::kStart));
  ASSERT_TRUE(world);
  while (world->all<OrganCut>()[0].bodies == 0 && world->time() < 3.0)
    step_until(*world, world->time() + 0.01);
  step_until(*world, world->time() + 0.5);
  EXPECT_FALSE(only_clip(*world).fell);
  EXPECT_DOUBLE_EQ(only_clip(*world).apart, only_clip(*world).shut);
  EXPECT_LT(sum_of_forces(*world, only_clip(*world)).norm(), 0.02 * only_clip(*world).squeeze);

  // A blade as wide as what the clip holds.
  SceneDescription scene = bar_to_cut(8e-3, 13e3, Fed::kStart);
  scene.instruments[1].extras.set(BladeDescription{16e-3, 5e-3});
  const auto other = build(scene);
  ASSERT_TRUE(other);
  FlagSet flags;
  flags.raise(step_until(*other, kShut));
  while (!only_clip(*other).fell && other->time() < 3.0)
    flags.raise(step_until(*other, other->time() + 0.01));
  flags.raise(step_until(*other, other->time() + 0.05));
  EXPECT_TRUE(only_clip(*other).fell);
  EXPECT_TRUE(flags.has(kClipFell));
}

TEST(Clips, AreToldByTheReport) {
  const auto world = build(bar_to_cut(0.0, 13e3, Fed::kStart));
  ASSERT_TRUE(world);
  step_until(*world, kShut);
  const auto sections = clips_feature().report(*world);
  ASSERT_EQ(sections.size(), 1u);
  const nlohmann::json told = nlohmann::json::parse(sections[0].json);
  ASSERT_EQ(told["applied"].size(), 1u);
  const nlohmann::json& clip = told["applied"][0];
  EXPECT_EQ(clip["organ"], "bar");
  EXPECT_EQ(clip["shut"], true);
  EXPECT_NEAR(clip["applied_s"].get<double>(), kApplied, 0.05);
  EXPECT_GT(clip["pressure_kPa"].get<double>(), 1.0);
  EXPECT_EQ(told["ducts"][0]["cut"], false);
}

TEST(Clips, ARunIsTheSameOnAnyNumberOfThreadsAndFromASnapshot) {
  expect_same_runs(build_shared(clipped_bar()), {0.3}, 0.7);
}

}  // namespace
}  // namespace viscera::test
