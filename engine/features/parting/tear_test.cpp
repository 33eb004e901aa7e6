// Blocks that their ends pull until they tear.
#include "engine/features/parting/tear.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/points/closed_pieces.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kPulledMost = 2.0;        // ends are farthest from each other then [s]
const Vec3 kStripSize(30e-3, 9e-3, 9e-3);  // [m]
constexpr double kSoftWithin = 7e-3, kStripPull = 8e-3;  // [m]

/// The ends are held, and go away from each other by `pulled`, or come nearer, until kPulledMost.
SceneDescription block_by_its_ends(const Vec3& size, double pulled, bool tears) {
  SceneDescription scene = held_bar_scene(size, 1.5e-3, 0.1e-3, 3e-3, 3e-3);
  OrganDescription& block = scene.organs[0];
  Region right;
  right.a = Vec3(0.5 * size.x() - 0.1e-3, 0, 0);
  right.b = -Vec3::UnitX();
  block.fixed.push_back(right);
  const double way = 0.5 * std::abs(pulled);
  const Vec3 out = pulled > 0.0 ? Vec3(Vec3::UnitX()) : Vec3(-Vec3::UnitX());
  set_hold_motions(
      block, {{0, {way, -out, 2.0 * kPulledMost, 0.0}}, {1, {way, out, 2.0 * kPulledMost, 0.0}}});
  block.response = Response::kFinite;
  block.extras.set(CuttableDescription{0.4e-3, tears});
  return scene;
}

/// A strip whose middle has a third of its ends' modulus: it is stretched most there, and not where
/// its ends are held.
SceneDescription strip_to_tear(bool tears = true) {
  SceneDescription scene = block_by_its_ends(kStripSize, kStripPull, tears);
  scene.organs[0].parts.push_back({.where = ball_region(Vec3::Zero(), kSoftWithin),
                                   .youngs_modulus = 3.3e3,
                                   .density = {},
                                   .fibres = {}});
  return scene;
}

/// A column that is pressed to 70 % of its length.
SceneDescription column_to_press(bool tears = true) {
  return block_by_its_ends({20e-3, 10e-3, 10e-3}, -6e-3, tears);
}

std::map<std::string, Tissue> tissues_that_fail_at(double strain) {
  std::map<std::string, Tissue> tissues = test_tissues();
  tissues.at("rubber").ultimate_strain = strain;
  return tissues;
}

std::unique_ptr<World> build_failing_at(double strain, const SceneDescription& scene) {
  std::vector<std::string> warnings;
  auto world = build_world(scene, tissues_that_fail_at(strain), {project_file("assets"), false},
                           no_progress(), warnings);
  if (!world) {
    ADD_FAILURE() << world.error().text();
    return nullptr;
  }
  return std::move(*world);
}

const OrganCut& torn_now(const World& world) {
  return world.all<OrganCut>()[0];
}

/// Over all points of the energy, as they are deformed now.
double greatest_strain(const World& world) {
  double most = 0.0;
  for (const PointDeformation& point : world.all<OrganBody>()[0].model->finite->body().deformations(
           world.all<OrganTouch>()[0].solver->state().motion.displacements))
    most = std::max(most, greatest_stretch(point.gradient).stretch - 1.0);
  return most;
}

/// That one of a scene reaches which doesn't tear.
double strain_at_most(const SceneDescription& scene) {
  const auto world = build_failing_at(0.0, scene);
  if (!world) return 0.0;
  step_until(*world, kPulledMost);
  EXPECT_EQ(torn_now(*world).torn, 0.0);
  EXPECT_TRUE(torn_now(*world).gone.untouched()) << "it was never asked to tear";
  EXPECT_EQ(torn_now(*world).bodies, 0u);
  return greatest_strain(*world);
}

// --- a point ------------------------------------------------------------------------------------

const LawModuli kLaw{3448.0, 3448.0, 27.6e3};  // of 10 kPa, Poisson's ratio 0.45
constexpr double kFails = 0.38;

/// Stretched so far along x and y, and free along z; `one`: along x alone, and free besides.
PointDeformation stretched(double l, bool one) {
  const double mu = kLaw.shear, bulk = kLaw.lambda + kLaw.averaged + mu;
  PointDeformation point;
  if (one) {
    const double volume = 1.0 + mu * (1.0 - 1.0 / l) / bulk, side = std::sqrt(volume / l);
    point.gradient = Vec3(l, side, side).asDiagonal();
    point.dilatation = volume - 1.0;
    return point;
  }
  // Along z: mu (z^2 / J - 1) + bulk (J - 1) = 0 with z = J / l^2.
  const double of_volume = bulk + mu / (l * l * l * l), volume = (bulk + mu) / of_volume;
  point.gradient = Vec3(l, l, volume / (l * l)).asDiagonal();
  point.dilatation = volume - 1.0;
  return point;
}

/// Squeezed along z with free sides, which become so much wider.
PointDeformation squeezed(double l) {
  const double mu = kLaw.shear, bulk = kLaw.lambda + kLaw.averaged + mu;
  // Across: mu (l^2 / J - 1) + bulk (J - 1) = 0.
  const double sum = bulk + mu,
               volume = (sum + std::sqrt(sum * sum - 4.0 * bulk * mu * l * l)) / (2.0 * bulk);
  PointDeformation point;
  point.gradient = Vec3(l, l, volume / (l * l)).asDiagonal();
  point.dilatation = volume - 1.0;
  return point;
}

TEST(TearLimit, IsPassedByAStripThatIsPulledBeyondItsUltimateStrainAndNotBefore) {
  const TearLimit limit = TearLimit::of(kLaw, kFails);
  EXPECT_FALSE(torn(stretched(1.0 + 0.99 * kFails, true), limit));
  const auto most = torn(stretched(1.0 + 1.01 * kFails, true), limit);
  ASSERT_TRUE(most);
  EXPECT_NEAR(most->stretch, 1.0 + 1.01 * kFails, 1e-12);
  EXPECT_NEAR(std::abs(most->direction.x()), 1.0, 1e-9) << "it parts across the pull";
  EXPECT_FALSE(torn({}, limit)) << "tissue at rest";
}

TEST(TearLimit, IsPassedByTissueThatIsPulledTwoWaysAtOnceAndNotByWhatIsSqueezedAsWide) {
  const TearLimit limit = TearLimit::of(kLaw, kFails);
  for (const double beyond : {1.01, 1.3}) {
    const double l = 1.0 + beyond * kFails;
    EXPECT_TRUE(torn(stretched(l, false), limit)) << beyond;
    const PointDeformation wide = squeezed(l);
    EXPECT_NEAR(greatest_stretch(wide.gradient).stretch, l, 1e-12);
    EXPECT_LT(wide.gradient(2, 2), 0.6) << "it is squeezed flat";
    EXPECT_NEAR(greatest_stress(kLaw, wide, l), 0.0, 1e-6 * kLaw.shear);
    EXPECT_FALSE(torn(wide, limit)) << beyond;
  }
}

TEST(TearLimit, DoesntDependOnHowTissueIsTurned) {
  const TearLimit limit = TearLimit::of(kLaw, kFails);
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const Mat3 other = Eigen::AngleAxisd(0.7, Vec3(0, 1, 3).normalized()).toRotationMatrix();
  for (const double share : {0.99, 1.01}) {
    PointDeformation point = stretched(1.0 + share * kFails, true);
    // Pulled along `other` x at rest, and turned after it.
    point.gradient = (turn * other * point.gradient * other.transpose()).eval();
    const auto most = torn(point, limit);
    EXPECT_EQ(most.has_value(), share > 1.0);
    if (!most) continue;
    EXPECT_NEAR(std::abs(most->direction.dot(other.col(0))), 1.0, 1e-9);
  }
}

TEST(TearLimit, TissueThatIsTurnedInsideOutIsNotAsked) {
  PointDeformation point = stretched(2.0, true);
  point.gradient.col(2) *= -1.0;
  EXPECT_FALSE(torn(point, TearLimit::of(kLaw, kFails)));
}

TEST(TornDisc, IsAPlateAndItsReachHoldsIt) {
  const TornDisc disc{Vec3(1e-3, 0, 0), Vec3(1, 1, 0).normalized(), 2e-3, 0.6e-3};
  EXPECT_NEAR(disc.distance(disc.middle), -0.3e-3, 1e-12);
  EXPECT_NEAR(disc.distance(disc.middle + 1e-3 * disc.across), 0.7e-3, 1e-12);
  EXPECT_NEAR(disc.distance(disc.middle + Vec3(0, 0, 2e-3)), -0.3e-3, 1e-12);
  EXPECT_NEAR(disc.distance(disc.middle + Vec3(0, 0, 3e-3)), 0.7e-3, 1e-12);
  const Box reach = disc.reach();
  for (int i = 0; i < 64; ++i) {
    const double angle = 0.1 * i;
    const Vec3 rim = disc.middle + 2e-3 * (std::cos(angle) * Vec3::UnitZ() +
                                           std::sin(angle) * Vec3(1, -1, 0).normalized());
    for (const double side : {-0.29e-3, 0.29e-3})
      EXPECT_TRUE(reach.contains(rim + side * disc.across)) << i;
  }
}

TEST(TornDisc, OfFourPointsOfACellLeaveNoTissueBetweenThem) {
  constexpr double kSize = 2e-3;  // cube root of a point's volume [m]
  TissueShare left(0.25e-3);
  const double apart = 2.0 / std::sqrt(3.0) * kSize;  // Gauss's two of a side
  const Vec3 across = Vec3(1, 0.3, 0.2).normalized();
  const Vec3 one = across.unitOrthogonal(), other = across.cross(one);
  for (const double a : {-0.5, 0.5})
    for (const double b : {-0.5, 0.5}) {
      const TornDisc disc{apart * (a * one + b * other), across, kOfTornDisc * kSize,
                          left.least_kerf()};
      left.take_out(disc.reach(), [&](const Vec3& place) { return disc.distance(place); });
    }
  for (double a = -0.5; a <= 0.5; a += 0.05)
    for (double b = -0.5; b <= 0.5; b += 0.05)
      EXPECT_LT(left.share(Vec3(apart * (a * one + b * other))), 0.5) << a << " " << b;
}

// --- an organ -----------------------------------------------------------------------------------

TEST(Tearing, AStripThatIsPulledBeyondItsUltimateStrainTearsAcrossWhereItIsStretchedMost) {
  const double strain = strain_at_most(strip_to_tear(false));
  ASSERT_GT(strain, 0.3);
  ASSERT_LT(strain, 2.0);
  const auto world = build_failing_at(0.6 * strain, strip_to_tear());
  ASSERT_TRUE(world);
  const TriangleSurface whole = world->all<OrganBody>()[0].model->surface;
  step_until(*world, 1.5 * kPulledMost);
  const OrganCut& cut = torn_now(*world);
  EXPECT_GE(cut.bodies, 1u) << "limit " << 0.6 * strain;
  EXPECT_EQ(cut.refused, 0u) << world->all<OrganLeft>()[0].refusal;
  EXPECT_EQ(cut.area, 0.0) << "no blade";
  // Every point of its middle has passed the limit before the pull was at its most, in a plane or
  // two: of a point's disc no more counts than its share of a plane.
  const double section = kStripSize.y() * kStripSize.z();
  EXPECT_GT(cut.torn, 0.3 * section) << 1e6 * cut.torn << " mm2";
  EXPECT_LT(cut.torn, 2.0 * section) << 1e6 * cut.torn << " mm2";
  const TriangleSurface& left = world->all<OrganBody>()[0].model->surface;
  for (const TriangleSurface& piece : closed_pieces(left))
    EXPECT_EQ(surface_defects(piece), std::vector<std::string>());
  EXPECT_LT(volume(left), volume(whole));
  const std::vector<float>& depths = world->all<OrganLeft>()[0].depths;
  ASSERT_EQ(depths.size(), left.vertices.size());
  for (std::size_t v = 0; v < depths.size(); ++v) {
    if (!(depths[v] > 0.3e-3f)) continue;
    EXPECT_LT(std::abs(left.vertices[v].x()), kSoftWithin + 2e-3)
        << left.vertices[v].transpose() << ": a wall beside the soft middle";
  }
}

TEST(Tearing, AStripThatIsPulledToSevenTenthsOfItsUltimateStrainHolds) {
  const double strain = strain_at_most(strip_to_tear(false));
  const auto world = build_failing_at(strain / 0.7, strip_to_tear());
  ASSERT_TRUE(world);
  step_until(*world, 1.1 * kPulledMost);
  EXPECT_EQ(torn_now(*world).torn, 0.0) << "it reached " << greatest_strain(*world);
  EXPECT_TRUE(torn_now(*world).gone.untouched());
  EXPECT_EQ(torn_now(*world).bodies, 0u);
}

TEST(Tearing, AColumnThatIsPressedFlatBeyondTheStrainHolds) {
  const double strain = strain_at_most(column_to_press(false));
  ASSERT_GT(strain, 0.12) << "free sides would become 1.17 times as wide";
  const auto world = build_failing_at(0.8 * strain, column_to_press());
  ASSERT_TRUE(world);
  step_until(*world, kPulledMost);
  EXPECT_GT(greatest_strain(*world), 0.8 * strain);
  EXPECT_EQ(torn_now(*world).torn, 0.0) << 1e6 * torn_now(*world).torn << " mm2";
  EXPECT_TRUE(torn_now(*world).gone.untouched());
}

TEST(Tearing, ATissueHoldsWhereTheOrganIsNotToTear) {
  const auto world = build_failing_at(0.1, strip_to_tear(false));
  ASSERT_TRUE(world);
  EXPECT_FALSE(may_tear(*world));
  step_until(*world, kPulledMost);
  EXPECT_GT(greatest_strain(*world), 0.1);
  EXPECT_TRUE(torn_now(*world).gone.untouched());
  EXPECT_EQ(torn_now(*world).bodies, 0u);
}

TEST(Tearing, ANewBodyOpensBeforeItTearsOn) {
  const auto world = build_failing_at(0.2, strip_to_tear());
  ASSERT_TRUE(world);
  EXPECT_TRUE(may_tear(*world));
  Trace trace(stage_names());
  std::uint64_t taken_at = 0, bodies = 0;
  double before = 0.0;
  int tears = 0;
  while (world->time() < 1.5 * kPulledMost) {
    step_frame(*world, trace);
    const OrganCut& cut = torn_now(*world);
    if (cut.bodies > bodies) taken_at = world->frame();
    bodies = cut.bodies;
    if (cut.torn == before) continue;
    before = cut.torn;
    EXPECT_TRUE(cut.changed);
    if (++tears == 1) continue;
    EXPECT_GE(world->frame(), taken_at + 12) << tears;
  }
  // The first takes what has passed the limit as it is passed, of a pull that goes on.
  EXPECT_GE(tears, 2);
}

TEST(Tearing, ARunIsTheSameOnAnyNumberOfThreadsAndFromASnapshot) {
  std::vector<std::string> warnings;
  auto made = build_model(strip_to_tear(), tissues_that_fail_at(0.25),
                          {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_TRUE(made) << made.error().text();
  expect_same_runs(Model(*made), {1.5, 2.0}, 2.4, [](const Simulation& at_end) {
    EXPECT_GE(torn_now(at_end.world()).bodies, 1u);
  });
}

TEST(Tearing, TheReportTellsWhatIsTornApartFromWhatIsCut) {
  const auto world = build_failing_at(0.25, strip_to_tear());
  ASSERT_TRUE(world);
  step_until(*world, kPulledMost);
  const double torn_area = torn_now(*world).torn;
  EXPECT_GT(torn_area, 0.0);
  const std::vector<ReportSection> sections = parting_report(*world);
  ASSERT_EQ(sections.size(), 1u);
  const nlohmann::json told = nlohmann::json::parse(sections[0].json);
  EXPECT_NEAR(told["torn_m2"].get<double>(), torn_area, 1e-6 * torn_area);
  EXPECT_NEAR(told["organs"][0]["torn_m2"].get<double>(), torn_area, 1e-6 * torn_area);
  EXPECT_EQ(told["organs"][0]["cut_area_m2"], 0.0);
}

TEST(Tearing, ATissueWhoseUltimateStrainIsNotKnownIsNamed) {
  std::vector<std::string> warnings;
  std::map<std::string, Tissue> tissues = tissues_that_fail_at(0.0);
  tissues["liver"] = tissues.at("rubber");
  tissues.at("liver").ultimate_strain = 0.38;
  const auto model = build_model(strip_to_tear(), tissues, {project_file("assets"), false},
                                 no_progress(), warnings);
  ASSERT_FALSE(model);
  EXPECT_NE(model.error().text().find(
                "organs/0/cuttable/tears: found true, but tissues/rubber/ultimate_strain isn't "
                "known; expected false, or a tissue that has it (liver)"),
            std::string::npos)
      << model.error().text();
}

TEST(Tearing, UltimateStrainsArriveFromTheProjectsFile) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  EXPECT_EQ(tissues->at("liver").ultimate_strain, 0.38);
  EXPECT_EQ(tissues->at("gallbladder").ultimate_strain, 0.43);
  EXPECT_EQ(tissues->at("stomach").ultimate_strain, 0.66);
  EXPECT_EQ(tissues->at("kidney").ultimate_strain, 0.0) << "not known";
}

}  // namespace
}  // namespace viscera::test
