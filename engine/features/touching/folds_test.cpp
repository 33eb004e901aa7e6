// Organs that touch themselves.
#include "engine/features/touching/folds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "engine/features/touching/touching.h"
#include "tests/support/blocks.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kLeafLong = 30e-3, kLeafWide = 16e-3, kLeafThick = 8e-3, kApart = 2e-3,
                 kRootLong = 6e-3, kStep = 2e-3;

/// Two leaves on a root about the plane z = 0, or the upper one alone; both held at x < 0.
TriangleSurface folded_leaves(bool both) {
  if (both) return leaves(Vec3(kLeafLong, kLeafWide, kLeafThick), kApart, kRootLong, kStep);
  const double low = 0.5 * kApart;
  return bricks(lines(-kRootLong, kLeafLong, kStep),
                lines(-0.5 * kLeafWide, 0.5 * kLeafWide, kStep),
                lines(low, low + kLeafThick, kStep), [](const Vec3&) { return true; });
}

class Folds : public testing::Test {
 protected:
  OrganDescription leaf(bool both, Response response) {
    const TriangleSurface surface = folded_leaves(both);
    FileGeometry geometry;
    geometry.file = folder_ / (both ? "both.obj" : "one.obj");
    geometry.unit = 1e-3;
    std::ofstream out(geometry.file);
    out.precision(12);
    for (const Vec3& x : surface.vertices) out << "v " << (1e3 * x).transpose() << "\n";
    for (const auto& [a, b, c] : surface.triangles)
      out << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
    OrganDescription organ;
    organ.name = "leaves";
    organ.geometry = geometry;
    organ.tissue = "rubber";
    organ.response = response;
    organ.resolution.spacing = organ.resolution.finest = 2.5e-3;
    Region root;
    root.a = Vec3::Zero();
    root.b = Vec3::UnitX();
    organ.fixed = {root};
    return organ;
  }

  /// A probe presses the leaf's tip by `press` [m]: from above, or from below its image.
  static InstrumentDescription probe(const std::string& name, double press, double side) {
    const double tip = 4e-3, out = 0.5 * kApart + kLeafThick + tip;
    return straight_tool(name, InstrumentKind::kProbe, tip,
                         {{0.0, Vec3(24e-3, 0, side * (out + 0.5e-3)), 0.0, 1.0},
                          {0.5, Vec3(24e-3, 0, side * (out - press)), 0.0, 1.0}});
  }

  SceneDescription folded(double press, Response response) {
    SceneDescription scene;
    scene.file = scene.name = "folds";
    scene.duration = 1.0;
    scene.organs = {leaf(true, response)};
    scene.instruments = {probe("above", press, 1.0), probe("below", press, -1.0)};
    scene.extras.set(TouchingDescription{.folds = true});
    return scene;
  }

  TemporaryFolder folder_;
};

double folded_force(const World& world) {
  Vec3 sum = Vec3::Zero();
  for (const PairState& pair : world.all<PairState>())
    for (const Meeting& meeting : pair.meetings) sum += meeting.force.cwiseAbs();
  return sum.z();
}

class FoldsThatClose : public Folds, public testing::WithParamInterface<Response> {};

TEST_P(FoldsThatClose, PressAsOneSideDoesOnAStillPlateInTheMiddle) {
  const double press = 1.5e-3;
  auto fold = build(folded(press, GetParam()));
  SceneDescription half = folded(press, GetParam());
  half.organs = {leaf(false, GetParam())};
  half.instruments.pop_back();
  OrganDescription plate;
  plate.name = "plate";
  plate.geometry = block_geometry(Vec3(80e-3, 40e-3, 20e-3), 4e-3);
  plate.tissue = "rubber";
  plate.pose.position = Vec3(30e-3, 0, -10e-3);
  plate.deformable = false;
  half.organs.push_back(plate);
  half.extras.set(TouchingDescription{.organs = true});
  auto reference = build(half);
  ASSERT_TRUE(fold && reference);
  EXPECT_EQ(but_for_strain(step_until(*fold, 1.0)), FlagSet());
  EXPECT_EQ(but_for_strain(step_until(*reference, 1.0)), FlagSet());
  const double expected = folded_force(*reference);
  EXPECT_GT(expected, 5e-3);
  EXPECT_NEAR(folded_force(*fold), expected, 0.05 * expected);
  EXPECT_NEAR(force_on(*fold, 0).z(), force_on(*reference, 0).z(),
              0.05 * force_on(*reference, 0).z());
  EXPECT_NEAR(force_on(*fold, 1).z(), -force_on(*fold, 0).z(), 0.05 * force_on(*fold, 0).z());
  EXPECT_LT(fold->one<TouchingFigures>()->greatest_overlap, 0.2e-3);
}
INSTANTIATE_TEST_SUITE_P(Responses, FoldsThatClose,
                         testing::Values(Response::kLinear, Response::kFinite), kByResponse);

TEST_F(Folds, PassThroughThemselvesWhereTheSceneDoesntAsk) {
  SceneDescription scene = folded(1.5e-3, Response::kLinear);
  scene.extras.set(TouchingDescription{.organs = true});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.6);
  EXPECT_FALSE(world->has<OrganPair>());
}

TEST_F(Folds, ThatStayApartPressNothing) {
  auto world = build(folded(0.5e-3, Response::kLinear));
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, 1.0)), FlagSet());
  EXPECT_EQ(folded_force(*world), 0.0);
}

TEST_F(Folds, AWallThatIsSqueezedDoesntMeetItsFarSide) {
  SceneDescription scene = folded(0.0, Response::kLinear);
  scene.organs[0].geometry = block_geometry(Vec3(40e-3, 30e-3, 4e-3), 1.5e-3);
  scene.organs[0].fixed[0].a = Vec3(-10e-3, 0, 0);
  scene.organs[0].resolution.spacing = scene.organs[0].resolution.finest = 2.5e-3;
  scene.instruments.clear();
  for (const double side : {1.0, -1.0})
    scene.instruments.push_back(
        straight_tool(side > 0.0 ? "above" : "below", InstrumentKind::kProbe, 4e-3,
                      {{0.0, Vec3(5e-3, 0, side * 6.5e-3), 0.0, 1.0},
                       {0.5, Vec3(5e-3, 0, side * (6e-3 - 0.6e-3)), 0.0, 1.0}}));
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.6);
  EXPECT_GT(force_on(*world, 0).z(), 1e-3);
  EXPECT_TRUE(world->all<PairState>()[0].meetings.empty());
}

TEST_F(Folds, ASavedStateGoesOnToTheSameBits) {
  auto world = build(folded(1.5e-3, Response::kFinite));
  ASSERT_TRUE(world);
  step_until(*world, 0.45);
  EXPECT_GT(folded_force(*world), 0.0);
  expect_same_from_saved(*world, 0.6);
}

}  // namespace
}  // namespace viscera::test
