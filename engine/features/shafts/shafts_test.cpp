#include "engine/features/shafts/shafts.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/render/instrument_mesh.h"
#include "engine/run/state_hash.h"
#include "engine/simulation/instruments.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kHalf = 20e-3;     // half the block's length, along x [m]
constexpr double kTop = 15e-3;      // of the block [m]
constexpr double kRadius = 2.5e-3;  // of shafts [m]
constexpr double kDown = 0.5;       // shafts are down [s]

/// A block 40 x 40 x 30 mm about the origin, held at its base.
SceneDescription block_scene(Response response = Response::kLinear) {
  SceneDescription scene =
      held_bar_scene(Vec3(2.0 * kHalf, 40e-3, 2.0 * kTop), 1.5e-3, 0.0, 6e-3, 3e-3);
  OrganDescription& block = scene.organs[0];
  Region base;
  base.a = Vec3(0, 0, -kTop + 1e-3);
  base.b = Vec3::UnitZ();
  block.fixed = {base};
  Region middle;
  middle.shape = Region::Shape::kBox;
  middle.a = Vec3(-kHalf - 1e-3, -9e-3, kTop - 9e-3);
  middle.b = Vec3(kHalf + 1e-3, 9e-3, kTop + 1e-3);
  block.resolution.fine = {middle};
  block.response = response;
  scene.extras.set(ShaftsDescription{.touch = true, .endoscope_radius = 5e-3});
  return scene;
}

/// Lies along x over the block, its tip beyond the block's left end, its trocar so far to the right
/// that it hardly turns; goes down until its lowest line is `depth` below the block's top.
InstrumentDescription lying_tool(double depth, double trocar = 2.0) {
  InstrumentDescription tool =
      straight_tool("rod", InstrumentKind::kProbe, kRadius,
                    {{0.0, Vec3(-45e-3, 0, kTop + kRadius + 0.5e-3), 0.0, 1.0},
                     {kDown, Vec3(-45e-3, 0, kTop + kRadius - depth), 0.0, 1.0}});
  tool.shaft_radius = kRadius;
  tool.trocar = Vec3(trocar, 0, kTop + kRadius - depth);
  return tool;
}

SceneDescription pressed_scene(double depth, Response response = Response::kLinear) {
  SceneDescription scene = block_scene(response);
  scene.instruments = {lying_tool(depth)};
  return scene;
}

/// Of all cells of the block, world [N].
Vec3 on_tissue(const World& world) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : world.all<OrganContact>()[0].solution.forces) sum += force;
  return sum;
}

/// How deep the drawn surface lies in the shaft of the first tool [m].
double drawn_inside(const World& world, double within = 1.0) {
  const ShaftAxis& axis = world.all<ShaftState>()[0].axis;
  double deepest = 0.0;
  for (const Vec3f& place : world.all<OrganState>()[0].positions) {
    const Vec3 off = place.cast<double>() - axis.begin;
    const double along = off.dot(axis.direction);
    if (along < 0.0 || along > axis.length || std::abs(place.x()) > within) continue;
    deepest = std::max(deepest, kRadius - (off - along * axis.direction).norm());
  }
  return deepest;
}

class PressingShaft : public testing::TestWithParam<Response> {};

TEST_P(PressingShaft, SinksInNoDeeperThanAskedAndPushesBackAsItIsPushed) {
  auto world = build(pressed_scene(1e-3, GetParam()));
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, 2.0 * kDown)), FlagSet());
  const ShaftState& shaft = world->all<ShaftState>()[0];
  EXPECT_GT(shaft.load.force.z(), 0.05);
  EXPECT_LT((shaft.load.force + on_tissue(*world)).norm(), 1e-9 * shaft.load.force.norm());
  EXPECT_LT(drawn_inside(*world, kHalf - 2e-3), 0.1e-3);
  EXPECT_LT(drawn_inside(*world), 0.12e-3) << "where the block ends";
  // The tip, beyond the block, meets nothing; no range of cells is its.
  EXPECT_FALSE(world->all<InstrumentContact>()[0].touching);
  EXPECT_TRUE(world->all<OrganTouch>()[0].ranges.empty());
}
INSTANTIATE_TEST_SUITE_P(Responses, PressingShaft,
                         testing::Values(Response::kLinear, Response::kFinite), kByResponse);

/// Force of a rigid cylinder pressed `depth` deep into the block's top along x, by many small cells
/// over the width that it can touch, beyond all that a shaft lays [N].
double force_of_fine_cells(double depth) {
  auto world = build(pressed_scene(depth));
  if (!world) return 0.0;
  constexpr int kColumns = 48, kRows = 9;
  const double pitch = 2.0 * kHalf / kColumns, half = std::sqrt(kRadius * depth);
  const double row = 2.0 * half / kRows;
  std::vector<ContactCell> cells;
  for (int i = 0; i < kColumns; ++i)
    for (int j = 0; j < kRows; ++j) {
      const double y = -half + (j + 0.5) * row;
      ContactCell cell;
      cell.position = Vec3(-kHalf + (i + 0.5) * pitch, y, kTop);
      cell.area = pitch * row;
      cell.depth = depth - (kRadius - std::sqrt(kRadius * kRadius - y * y));
      cells.push_back(cell);
    }
  ContactSolution solution;
  ContactResponse response;
  world->all<OrganTouch>()[0].solver->solve(cells, solution, response);
  EXPECT_TRUE(solution.converged);
  double sum = 0.0;
  for (const Vec3& force : solution.forces) sum -= force.z();
  return sum;
}

TEST(Shafts, PressAsHardAsARigidCylinder) {
  for (const double depth : {0.5e-3, 1e-3, 2e-3}) {
    auto world = build(pressed_scene(depth));
    ASSERT_TRUE(world);
    step_until(*world, 2.0 * kDown);
    const double expected = force_of_fine_cells(depth);
    EXPECT_NEAR(world->all<ShaftState>()[0].load.force.z(), expected, 0.05 * expected)
        << "depth " << depth;
  }
}

TEST(Shafts, PressedNearlyAsDeepAsTheyAreThickSinkInAFifthOfAMillimetreAtEdges) {
  auto world = build(pressed_scene(2e-3));
  ASSERT_TRUE(world);
  step_until(*world, 2.0 * kDown);
  EXPECT_LT(drawn_inside(*world, kHalf - 2e-3), 0.15e-3);
  EXPECT_LT(drawn_inside(*world), 0.25e-3);
}

TEST(Shafts, ThatRestKeepTheirForce) {
  auto world = build(pressed_scene(2e-3));
  ASSERT_TRUE(world);
  step_until(*world, 2.0 * kDown);
  const double first = world->all<ShaftState>()[0].load.force.z();
  for (int frame = 0; frame < 30; ++frame) {
    step_until(*world, world->time() + 1.0 / 60.0);
    EXPECT_NEAR(world->all<ShaftState>()[0].load.force.z(), first, 1e-3 * first);
  }
}

TEST(Shafts, LetGoAndTheBodyIsAtRestAgain) {
  SceneDescription scene = pressed_scene(2e-3);
  scene.instruments[0].path.push_back({2.0 * kDown, Vec3(-45e-3, 0, kTop + 10e-3), 0.0, 1.0});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 3.0 * kDown);
  EXPECT_EQ(world->all<ShaftState>()[0].load.force, Vec3::Zero());
  EXPECT_EQ(world->all<OrganState>()[0].positions,
            world->all<OrganBody>()[0].model->rest_positions);
}

TEST(Shafts, SweptAgainstABlockAt100MillimetresASecondDontPassThroughIt) {
  // Against the block's side, halfway up, 8 mm into it.
  SceneDescription scene = block_scene();
  InstrumentDescription tool = lying_tool(0.0);
  const double side = 20e-3 + kRadius;
  tool.path = {{0.0, Vec3(-45e-3, -side - 10e-3, 5e-3), 0.0, 1.0},
               {0.18, Vec3(-45e-3, -side + 8e-3, 5e-3), 0.0, 1.0}};
  tool.trocar = Vec3(2.0, -side, 5e-3);
  scene.instruments = {tool};
  auto world = build(scene);
  ASSERT_TRUE(world);
  for (int frame = 0; frame < 20; ++frame) {
    const FlagSet flags = step_until(*world, world->time() + 1.0 / 60.0);
    EXPECT_FALSE(flags.has(kShaftInside));
    // A row is as wide as the last frame's force asks for: one frame late.
    EXPECT_LT(drawn_inside(*world, kHalf - 2e-3), 0.5 * kRadius) << "frame " << frame;
  }
  EXPECT_LT(world->all<ShaftState>()[0].load.force.y(), -0.1);
  // It wraps round the shaft, three radii deep.
  EXPECT_LT(drawn_inside(*world, kHalf - 2e-3), 0.4e-3);
}

TEST(Shafts, OfAThinFlapThatIsHitFastFromAboveStayAboveIt) {
  // 3 mm thick, thinner than the shaft: the nearest place of it is soon its far side.
  SceneDescription scene = held_bar_scene(Vec3(60e-3, 30e-3, 3e-3), 1.5e-3, 10e-3, 4e-3, 2e-3);
  scene.extras.set(ShaftsDescription{.touch = true, .endoscope_radius = 0.0});
  InstrumentDescription tool = straight_tool(
      "rod", InstrumentKind::kProbe, 1e-3,
      {{0.0, Vec3(10e-3, -60e-3, 8e-3), 0.0, 1.0}, {0.15, Vec3(10e-3, -60e-3, -6e-3), 0.0, 1.0}});
  tool.shaft_radius = 1e-3;
  tool.trocar = Vec3(10e-3, 2.0, 0.0);
  scene.instruments = {tool};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.4);
  const ShaftState& shaft = world->all<ShaftState>()[0];
  EXPECT_GT(shaft.load.force.z(), 0.0);
  // What lies under the shaft was pushed down by it.
  for (const Vec3f& p : world->all<OrganState>()[0].positions)
    if (std::abs(p.x() - 10e-3f) < 1e-3f) {
      EXPECT_LT(p.z(), -5.5e-3f);
    }
}

TEST(Shafts, ReachTheHandByTheLeverAboutTheTrocar) {
  SceneDescription scene = pressed_scene(2e-3);
  scene.instruments[0].trocar = Vec3(105e-3, 0, kTop + kRadius - 2e-3);
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.0 * kDown);
  const ShaftState& shaft = world->all<ShaftState>()[0];
  const double force = shaft.load.force.norm();
  ASSERT_GT(force, 0.05);
  EXPECT_LT((shaft.load.force + shaft.lever.reaction - shaft.lever.at_tip).norm(), 1e-9 * force);
  const Vec3 arm = world->all<InstrumentState>()[0].tip - scene.instruments[0].trocar;
  EXPECT_LT(
      (arm.cross(shaft.lever.at_tip) + shaft.lever.twist * arm.normalized() - shaft.load.torque)
          .norm(),
      1e-9 * shaft.load.torque.norm());
  // The block's middle is 105 mm from the trocar, the tip 150 mm.
  EXPECT_NEAR(shaft.lever.at_tip.norm() / force, 0.7, 0.02);
  EXPECT_EQ(force_on(*world, 0), shaft.lever.at_tip);
}

TEST(Shafts, WithFrictionDragTheTissueAlongAsTheySlide) {
  SceneDescription scene = pressed_scene(1.5e-3);
  scene.instruments[0].friction = 0.3;
  const Vec3 low = scene.instruments[0].path.back().tip;
  scene.instruments[0].path.push_back({kDown + 0.1, low, 0.0, 1.0});
  scene.instruments[0].path.push_back({2.0 * kDown, low - Vec3(8e-3, 0, 0), 0.0, 1.0});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.0 * kDown);
  const Vec3 on_shaft = world->all<ShaftState>()[0].load.force;
  const double share = on_shaft.x() / on_shaft.z();
  EXPECT_GT(share, 0.15);
  EXPECT_LT(share, 0.3 + 1e-6);
}

TEST(Shafts, ChangeNothingWhereTheSceneDoesntAskForThem) {
  SceneDescription silent = pressed_scene(2e-3);
  silent.extras = {};
  SceneDescription off = pressed_scene(2e-3);
  off.extras.set(ShaftsDescription{});
  auto one = build(silent), other = build(off);
  ASSERT_TRUE(one && other);
  step_until(*one, kDown);
  step_until(*other, kDown);
  EXPECT_FALSE(other->has<ShaftState>());
  EXPECT_EQ(StateHash().finish(*one), StateHash().finish(*other));
  EXPECT_FALSE(one->all<OrganState>()[0].deformed);
}

TEST(Shafts, GiveTheSameBitsForAnyNumberOfThreads) {
  std::string hashes[2];
  for (const int threads : {1, 3}) {
    using oneapi::tbb::global_control;
    const global_control limit(global_control::max_allowed_parallelism,
                               static_cast<std::size_t>(threads));
    auto world = build(pressed_scene(2e-3, Response::kFinite));
    ASSERT_TRUE(world);
    step_until(*world, 0.3);
    hashes[threads == 1 ? 0 : 1] = StateHash().finish(*world);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Shafts, ASavedStateGoesOnToTheSameBits) {
  SceneDescription scene = pressed_scene(2e-3);
  scene.instruments[0].friction = 0.2;
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  ASSERT_FALSE(world->all<ShaftState>()[0].meetings.empty());
  expect_same_from_saved(*world, 0.45);
}

TEST(Shafts, AStateWithCellsOnTrianglesThatArentThereIsTakenWithoutThem) {
  auto world = build(pressed_scene(2e-3));
  ASSERT_TRUE(world);
  step_until(*world, 0.4);
  ShaftMeeting& meeting = world->all<ShaftState>()[0].meetings.at(0);
  ASSERT_FALSE(meeting.stretches.empty());
  meeting.stretches[0].points.at(0).triangle = 1 << 30;
  auto other = start_world(world->shared_model());
  ASSERT_TRUE(other);
  ASSERT_TRUE((*other)->load_state(world->save_state()));
  EXPECT_TRUE((*other)->all<ShaftState>()[0].meetings.empty());
  step_until(**other, 0.45);
}

TEST(Shafts, ThatBeginInsideAnOrganDontTouchItAndItIsToldWhereAndHowDeep) {
  SceneDescription scene = pressed_scene(2e-3);
  scene.file = "scene.json";
  scene.instruments[0].path = {{0.0, Vec3(-45e-3, 0, 10e-3), 0.0, 1.0}};
  scene.instruments[0].trocar = Vec3(0.2, 0, 10e-3);
  std::vector<std::string> warnings;
  auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_TRUE(world) << world.error().text();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0],
            "scene.json: instruments/0: the shaft of \"rod\" begins 7.5 mm inside organ \"bar\": "
            "it doesn't touch that organ (contact/shafts)");
  EXPECT_EQ(step_until(**world, 0.1), FlagSet());
  EXPECT_TRUE((*world)->all<ShaftState>()[0].meetings.empty());
  EXPECT_FALSE((*world)->all<OrganState>()[0].deformed);
}

TEST(Shafts, WhoseTrocarLiesInAnOrganDontTouchIt) {
  SceneDescription scene = pressed_scene(2e-3);
  scene.instruments[0].path = {{0.0, Vec3(-80e-3, 0, 5e-3), 0.0, 1.0}};
  scene.instruments[0].trocar = Vec3(-15e-3, 0, 5e-3);
  auto world = build(scene);
  ASSERT_TRUE(world);
  const Shaft& shaft = world->all<Shaft>()[0];
  ASSERT_EQ(shaft.spared.size(), 1u);
  EXPECT_TRUE(shaft.spared[0].holds_trocar);
}

TEST(Shafts, TheEndoscopesBarrelPressesToo) {
  SceneDescription scene = block_scene();
  CameraDescription camera;
  const double low = kTop + 5e-3 - 2e-3;
  camera.path = {{0.0, Vec3(-60e-3, 0, low + 3e-3), Vec3(-90e-3, 0, low + 3e-3), 0.0},
                 {kDown, Vec3(-60e-3, 0, low), Vec3(-90e-3, 0, low), 0.0}};
  scene.camera = camera;
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.0 * kDown);
  ASSERT_EQ(world->all<ShaftState>().size(), 1u);
  EXPECT_EQ(world->all<Shaft>()[0].name, "endoscope");
  EXPECT_GT(world->all<ShaftState>()[0].load.force.z(), 0.05);
  EXPECT_LT(on_tissue(*world).z(), -0.05);
  const auto report = shafts_report(*world);
  ASSERT_EQ(report.size(), 1u);
  EXPECT_EQ(report[0].key, "shafts");
  EXPECT_NE(report[0].json.find("endoscope"), std::string::npos);
  EXPECT_EQ(report[0].json.find("trocar"), std::string::npos) << "nobody says where it has one";
}

TEST(Shafts, OfAGrasperPressTheOrganThatItHolds) {
  SceneDescription scene = block_scene();
  // Holds the block's far left upper edge; the shaft lies 1 mm deep over the rest of it.
  InstrumentDescription grasper = lying_tool(1e-3, 0.3);
  grasper.kind = InstrumentKind::kGrasper;
  grasper.tip.radius = 1.5e-3;
  grasper.path = {{0.0, Vec3(-17e-3, 0, kTop + kRadius + 0.5e-3), 0.0, 1.0},
                  {0.2, Vec3(-17e-3, 0, kTop + kRadius + 0.5e-3), 0.0, 0.0},
                  {kDown, Vec3(-17e-3, 0, kTop + kRadius - 1e-3), 0.0, 0.0}};
  scene.instruments = {grasper};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.0 * kDown);
  ASSERT_TRUE(world->all<InstrumentContact>()[0].grasp);
  EXPECT_GT(world->all<ShaftState>()[0].load.force.z(), 0.02);
  ASSERT_EQ(world->all<OrganTouch>()[0].ranges.size(), 1u);
  EXPECT_TRUE(world->all<OrganTouch>()[0].ranges[0].held);
}

TEST(ShaftAxis, BeginsWhereTheDrawnInstrumentIsAsWideAsItsShaft) {
  for (const auto& [kind, drawn] :
       {std::pair(InstrumentKind::kProbe, InstrumentView::Kind::kProbe),
        std::pair(InstrumentKind::kHook, InstrumentView::Kind::kHook),
        std::pair(InstrumentKind::kSpatula, InstrumentView::Kind::kSpatula),
        std::pair(InstrumentKind::kGrasper, InstrumentView::Kind::kGrasper)}) {
    InstrumentBody body;
    body.description.kind = kind;
    body.description.tip.radius = 1e-3;
    InstrumentView view;
    view.kind = drawn;
    view.tip_radius = 1e-3;
    view.shaft_radius = body.description.shaft_radius;
    const ShaftBegin begin = shaft_begin(body);
    double first = 1.0;
    for (const InstrumentVertex& vertex : make_instrument(view).vertices) {
      const Vec3 at = vertex.position.cast<double>();
      const double off = std::hypot(at.x() + begin.aside, at.y());
      if (std::abs(off - view.shaft_radius) < 0.11 * view.shaft_radius)
        first = std::min(first, at.z());
    }
    EXPECT_NEAR(begin.along, first, 1.6e-3) << static_cast<int>(kind);
  }
}

}  // namespace
}  // namespace viscera::test
