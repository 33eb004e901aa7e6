// A hook that takes tissue by heat.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/coagulation/coagulation.h"
#include "engine/features/parting/parting.h"
#include "engine/features/parting/perforations.h"
#include "engine/features/smoke/smoke.h"
#include "engine/simulator/build.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kHigh = 6e-3;   // of the block's top [m]
constexpr double kHalf = 5e-3;   // of the hook's way [m]
constexpr double kUntil = 1.4;   // it has current [s]
constexpr double kOpened = 3.0;  // what is gone by then is gone from the organ, too [s]

/// A hook goes along x over the top of a block that its left end holds.
SceneDescription block_to_vaporise(double power) {
  SceneDescription scene =
      held_bar_scene({24e-3, 14e-3, 2.0 * kHigh}, 2e-3, 0.1e-3, 4.2e-3, 4.2e-3);
  OrganDescription& block = scene.organs[0];
  block.response = Response::kFinite;
  block.extras.set(CuttableDescription{0.25e-3});
  InstrumentDescription hook =
      straight_tool("hook", InstrumentKind::kHook, 0.8e-3,
                    {{0.0, Vec3(-kHalf, 0, kHigh + 3e-3), 0.0, 1.0},
                     {0.2, Vec3(-kHalf, 0, kHigh + 0.4e-3), power, 1.0},
                     {kUntil, Vec3(kHalf, 0, kHigh + 0.4e-3), 0.0, 1.0},
                     {kUntil + 0.1, Vec3(kHalf, 0, kHigh + 9e-3), 0.0, 1.0}});
  hook.extras.set(CurrentMode::kCut);
  scene.instruments = {hook};
  SmokeDescription smoke;
  smoke.name = "plume";
  smoke.domain = Box(Vec3(-30e-3, -30e-3, -20e-3), Vec3(30e-3, 30e-3, 60e-3));
  scene.extras.set(SmokeDescriptions{smoke});
  return scene;
}

const OrganCut& cut_now(const World& world) {
  return world.all<OrganCut>()[0];
}
const Bioheat& heat_now(const World& world) {
  return world.all<OrganBurn>()[0].heat;
}

TEST(Vaporised, WhatLeavesAsVapourIsGoneFromTheOrgan) {
  const auto world = build(block_to_vaporise(40.0));
  ASSERT_TRUE(world);
  const TriangleSurface whole = world->all<OrganBody>()[0].model->surface;
  EXPECT_EQ(step_until(*world, kOpened), FlagSet());
  EXPECT_GE(cut_now(*world).bodies, 1u);
  EXPECT_EQ(cut_now(*world).refused, 0u);
  const TriangleSurface& left = world->all<OrganBody>()[0].model->surface;
  EXPECT_EQ(surface_defects(left), std::vector<std::string>());
  // A voxel with less than half of its mass left is gone, one with more stays.
  const double mass = heat_now(*world).vaporised_water() + heat_now(*world).vaporised_tissue();
  const double vapour = mass / heat_now(*world).tissue().density;
  const double taken = volume(whole) - volume(left);
  EXPECT_GT(vapour, 1e-9);
  EXPECT_NEAR(taken, vapour, 0.35 * vapour);
  EXPECT_NEAR(cut_now(*world).vaporised, vapour, 0.15 * vapour);
  // A groove under the tip's way, no wider than the tip and no deeper than a millimetre or two.
  double deepest = 0.0;
  for (std::size_t v = 0; v < left.vertices.size(); ++v) {
    if (!(world->all<OrganLeft>()[0].depths[v] > 0.1e-3f)) continue;
    const Vec3& place = left.vertices[v];
    deepest = std::max(deepest, kHigh - place.z());
    EXPECT_LT(std::abs(place.y()), 1.6e-3) << place.transpose();
    EXPECT_LT(std::abs(place.x()), kHalf + 2e-3) << place.transpose();
  }
  EXPECT_GT(deepest, 0.4e-3);
  EXPECT_LT(deepest, 3e-3);
}

TEST(Vaporised, AWallIsPerforatedWhereItIsThinnerThanWhatIsGoneIsDeep) {
  for (const bool cuttable : {true, false})
    for (const auto& [wall, perforations] :
         {std::pair<double, std::size_t>(0.3e-3, 1), std::pair<double, std::size_t>(5e-3, 0)}) {
      SceneDescription scene = block_to_vaporise(40.0);
      scene.organs[0].extras.set(WallDescription{wall});
      if (!cuttable) scene.organs[0].extras.remove<CuttableDescription>();
      const auto world = build(scene);
      ASSERT_TRUE(world);
      EXPECT_EQ(wall_figures(*world)[0].perforations, 0u);
      EXPECT_EQ(wall_figures(*world)[0].depth, 0.0);
      step_until(*world, kUntil);
      const std::vector<WallFigures> walls = wall_figures(*world);
      ASSERT_EQ(walls.size(), 1u);
      EXPECT_EQ(walls[0].wall, wall);
      EXPECT_EQ(walls[0].perforations, perforations) << cuttable;
      EXPECT_GT(walls[0].depth, 0.3e-3);
      EXPECT_LT(walls[0].depth, 3e-3);
    }
}

TEST(Vaporised, TwoHolesThroughAWallAreTwoPerforations) {
  SceneDescription scene = block_to_vaporise(40.0);
  scene.organs[0].extras.set(WallDescription{0.4e-3});
  InstrumentDescription& hook = scene.instruments[0];
  const auto at = [](double time, double x, double above, double power) {
    return InstrumentKey{time, Vec3(x, 0, kHigh + above), power, 1.0};
  };
  constexpr double kUp = 6e-3, kOn = 0.3e-3;
  hook.path = {at(0.0, -kHalf, kUp, 0.0), at(0.2, -kHalf, kOn, 40.0), at(0.7, -kHalf, kOn, 0.0),
               at(0.8, -kHalf, kUp, 0.0), at(0.9, kHalf, kUp, 0.0),   at(1.0, kHalf, kOn, 40.0),
               at(1.5, kHalf, kOn, 0.0),  at(1.6, kHalf, kUp, 0.0)};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.85);
  EXPECT_EQ(wall_figures(*world)[0].perforations, 1u);
  step_until(*world, 1.7);
  EXPECT_EQ(wall_figures(*world)[0].perforations, 2u);
}

TEST(Vaporised, ThermalSpreadIsHowFarBelowTheWallsDeadTissueLies) {
  const auto world = build(block_to_vaporise(40.0));
  ASSERT_TRUE(world);
  step_until(*world, kOpened);
  ASSERT_GE(cut_now(*world).bodies, 1u);
  const double spread = dead_depth(*world, world->all<OrganBody>().owner(0));
  EXPECT_GT(spread, 0.3e-3);
  EXPECT_LT(spread, 4e-3);
  // From the whole surface it would be deeper by about the groove's depth.
  const SurfaceTree whole(world->all<Cuttable>()[0].organ->whole->surface);
  double from_top = 0.0;
  const HeatBricks& bricks = heat_now(*world).bricks();
  for (std::size_t b = 0; b < bricks.count(); ++b)
    for (int v = 0; v < BrickField::kVoxels; ++v)
      if (is_dead(bricks.brick(b), static_cast<std::size_t>(v)))
        from_top = std::max(from_top, -whole.signed_distance(bricks.centre(bricks.brick(b), v)));
  EXPECT_GT(from_top, spread + 0.2e-3);
}

TEST(Vaporised, TheBookOfHeatClosesAsWarmTissueGoes) {
  const auto world = build(block_to_vaporise(40.0));
  ASSERT_TRUE(world);
  step_until(*world, kOpened);
  const HeatBook book = heat_now(*world).book();
  EXPECT_GT(book.removed, 0.0);
  EXPECT_LT(std::abs(book.residual()), 1e-4 * book.delivered);
  ASSERT_TRUE(cautery_figures(*world));
  EXPECT_LT(std::abs(cautery_figures(*world)->residual), 1e-4);
}

TEST(Vaporised, ASlightBurnTakesNothing) {
  const auto world = build(block_to_vaporise(0.5));
  ASSERT_TRUE(world);
  step_until(*world, kOpened);
  EXPECT_GT(heat_now(*world).greatest_excess(), 5.0);
  EXPECT_EQ(cut_now(*world).bodies, 0u);
  EXPECT_TRUE(cut_now(*world).gone.untouched());
}

TEST(Vaporised, WhatHasCoagulatedStaysStiffAsTheBodyBecomesAnother) {
  const auto world = build(block_to_vaporise(40.0));
  ASSERT_TRUE(world);
  Trace trace(stage_names());
  int looked_at = 0;
  double before = 1.0;
  std::int64_t updates = 0;
  std::uint64_t bodies = 0;
  while (world->time() < kOpened) {
    step_frame(*world, trace);
    if (world->all<OrganChange>().size() == 0) continue;
    const OrganChange& change = world->all<OrganChange>()[0];
    const OrganUpdate& update = world->all<OrganUpdate>()[0];
    // In a frame in which it becomes another body and has no other update than before.
    if (cut_now(*world).bodies > bodies && change.updates == updates && updates > 0) {
      ASSERT_TRUE(update.update);
      EXPECT_EQ(update.made_of.stiffness.size(),
                world->all<OrganBody>()[0].model->energy_points.size());
      EXPECT_NEAR(update.update->greatest_stiffness, before, 0.1 * before);
      EXPECT_EQ(world->all<OrganTouch>()[0].solver->update(), update.update.get());
      ++looked_at;
    }
    bodies = cut_now(*world).bodies;
    updates = change.updates;
    if (update.update) before = update.update->greatest_stiffness;
  }
  EXPECT_GT(before, 2.0);
  EXPECT_GT(looked_at, 0);
  EXPECT_TRUE(stiffening_of(*world, world->all<OrganBody>().owner(0)));
}

TEST(Vaporised, SmokeComesOutOfTheGrooveAndStaysOutOfTheTissue) {
  const auto world = build(block_to_vaporise(40.0));
  ASSERT_TRUE(world);
  const SmokeVolume& smoke = world->all<SmokeBody>()[0].volume;
  Trace trace(stage_names());
  double after = 0.0;
  while (world->time() < kOpened) {
    const double emitted = smoke.book().emitted;
    step_frame(*world, trace);
    if (cut_now(*world).bodies > 0) after += smoke.book().emitted - emitted;
    const CollisionSurface& surface = *world->all<OrganContact>()[0].surface;
    for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
      const Vec3 place =
          smoke.parameters().domain.min() + smoke.particles().position(i).cast<double>();
      const auto hit = surface.closest(place, 3e-3);
      if (!hit) continue;
      const auto& t = world->all<OrganBody>()[0]
                          .model->surface.triangles[static_cast<std::size_t>(hit->point.triangle)];
      const auto corner = [&](int c) -> Vec3 {
        return world->all<OrganState>()[0].positions[static_cast<std::size_t>(t[c])].cast<double>();
      };
      const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
      EXPECT_GT((place - hit->position).dot(normal), -0.3e-3) << world->time();
    }
  }
  EXPECT_GT(after, 0.0);
}

TEST(Vaporised, ARunIsTheSameOnAnyNumberOfThreadsAndFromASnapshot) {
  expect_same_runs(build_shared(block_to_vaporise(40.0)), {0.9, 1.6}, kOpened,
                   [](const Simulation& at_end) { EXPECT_GE(cut_now(at_end.world()).bodies, 1u); });
}

/// What building it says: why it is refused, or what a person should know.
std::string said_of(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  const auto model =
      build_model(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  std::string said = model ? "" : model.error().text();
  for (const std::string& warning : warnings) said += warning + "\n";
  return said;
}

TEST(Vaporised, VoxelsOfHeatThatCutsWouldBeLostInAreRefusedWithTheirPlace) {
  SceneDescription scene = block_to_vaporise(40.0);
  scene.organs[0].extras.set(CuttableDescription{0.1e-3});
  EXPECT_NE(said_of(scene).find("organs/0/cuttable/voxel_mm: found 0.1 where heat/voxel_mm is 0.5, "
                                "expected 0.25 to 0.5"),
            std::string::npos)
      << said_of(scene);
  scene.organs[0].extras.set(CuttableDescription{0.8e-3});
  EXPECT_NE(said_of(scene).find("organs/0/cuttable/voxel_mm: found 0.8"), std::string::npos);
}

TEST(Vaporised, AWallThickerThanItsOrganIsRefusedAndOneThatNothingReachesIsTold) {
  SceneDescription scene = block_to_vaporise(40.0);
  scene.organs[0].extras.set(WallDescription{20e-3});
  EXPECT_NE(said_of(scene).find("organs/0/wall_mm: found 20, expected at most"), std::string::npos)
      << said_of(scene);
  scene = block_to_vaporise(0.0);
  scene.organs[0].extras.remove<CuttableDescription>();
  scene.organs[0].extras.set(WallDescription{2e-3});
  EXPECT_NE(said_of(scene).find("organs/0/wall_mm: nothing cuts or heats this organ"),
            std::string::npos)
      << said_of(scene);
}

/// How far below the skin at rest current enters a block that its base holds, at the most, where
/// the base rises so far meanwhile [m].
double deepest_current(double lifted) {
  SceneDescription scene = block_to_vaporise(40.0);
  Region base;
  base.a = Vec3(0, 0, -kHigh + 0.1e-3);
  base.b = Vec3::UnitZ();
  scene.organs[0].fixed = {base};
  const MotionDescription rise{lifted, Vec3::UnitZ(), 3.2, 0.0};
  if (lifted > 0.0) set_hold_motions(scene.organs[0], {{0, rise}});
  constexpr double kDown = 1.5e-3;
  std::vector<InstrumentKey>& path = scene.instruments[0].path;
  path = {{0.0, Vec3(0, 0, kHigh + 12e-3), 0.0, 1.0}};
  for (int tenth = 6; tenth <= 16; ++tenth) {
    const double time = 0.1 * tenth, height = tenth < 8 ? 8e-3 : -kDown;
    path.push_back({time, Vec3(0, 0, kHigh + height) + rise.displacement(time),
                    tenth < 8 || tenth == 16 ? 0.0 : 40.0, 1.0});
  }
  const auto world = build(scene);
  if (!world) return 0.0;
  Trace trace(stage_names());
  double deepest = 0.0;
  while (world->time() < 1.6) {
    step_frame(*world, trace);
    const BurnTrace& burn = world->all<BurnTrace>()[0];
    if (burn.current.power > 0.0) deepest = std::max(deepest, kHigh - burn.contact.point.z());
  }
  return deepest;
}

TEST(Vaporised, MetalSinksInAsFarIntoTissueThatIsLiftedAsIntoTissueThatIsNot) {
  const double still = deepest_current(0.0), lifted = deepest_current(3e-3);
  EXPECT_GT(still, 0.4e-3);
  EXPECT_NEAR(lifted, still, 0.3e-3);
}

}  // namespace
}  // namespace viscera::test
