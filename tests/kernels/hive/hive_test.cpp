#include "kernels/hive/hive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "engine/verification/hemisphere_body.h"
#include "kernels/contact/unilateral.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr double kRadius = kHemisphereRadius;
constexpr double kUnit = kHemisphereModulus * kRadius * kRadius * kHemisphereDepth;  // [N]
constexpr double kTool = 0.1;                                                        // over R
constexpr int kRings = 3;

struct Ground {
  std::unique_ptr<HemisphereBody> body;
  std::unique_ptr<WalkableSurface> surface;
  HiveBody on() const { return {surface.get(), &body->compliance(), &body->touchable()}; }
};

const Ground& ground(double poisson_ratio) {
  static std::map<double, Ground> all;
  Ground& one = all[poisson_ratio];
  if (one.body) return one;
  HemisphereOptions options;
  options.poisson_ratio = poisson_ratio;
  options.nodes = 800;
  auto body = HemisphereBody::prepare(options, no_progress());
  EXPECT_TRUE(body);
  one.body = std::move(*body);
  auto surface = WalkableSurface::make(one.body->surface());
  EXPECT_TRUE(surface);
  one.surface = std::make_unique<WalkableSurface>(std::move(*surface));
  return one;
}

double reference_force(double poisson_ratio) {
  const auto references =
      read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  EXPECT_TRUE(references);
  return find_reference(*references, poisson_ratio, kTool)->frictionless;
}

HiveSettings settings_of(double poisson_ratio, HivePeriphery periphery, double radius, int nodes) {
  HiveSettings settings;
  settings.material = {kHemisphereModulus, poisson_ratio};
  settings.periphery = periphery;
  settings.radius = radius * kRadius;
  settings.nodes = nodes;
  return settings;
}

std::vector<double> depths_of(std::span<const ContactCell> cells) {
  std::vector<double> depths;
  for (const ContactCell& cell : cells) depths.push_back(cell.depth);
  return depths;
}

Vec3 on_dome(double tilt) {
  return kRadius * Vec3(std::sin(tilt), 0, std::cos(tilt));
}

Hive hive_at(const Ground& ground, const HiveSettings& settings, double tilt) {
  auto hive = Hive::create(ground.on(), settings, 127);
  EXPECT_TRUE(hive) << hive.error().text();
  EXPECT_EQ(hive->build(ground.surface->nearest(on_dome(tilt))), HiveVerdict::kSound);
  return std::move(*hive);
}

std::vector<ContactCell> tool(double poisson_ratio, double tilt = 0.0) {
  return HemisphereBody::cells(HemisphereContact::kFrictionless, poisson_ratio, kTool, kRings,
                               tilt);
}

/// Force down the axis over E R delta, against the reference.
double force_error(Hive& hive, double poisson_ratio) {
  const auto cells = tool(poisson_ratio);
  EXPECT_EQ(hive.seat(cells), HiveVerdict::kSound);
  const HiveForce force = hive.press(depths_of(cells));
  EXPECT_EQ(force.verdict, HiveVerdict::kSound);
  EXPECT_EQ(hive.figures().lifted, 0.0);
  return force.force.z() / kUnit / reference_force(poisson_ratio) - 1.0;
}

TEST(Hive, CoupledForceIsTheReferencesForEveryRadiusAndNumberOfNodes) {
  for (const double nu : {0.30, 0.45}) {
    for (const int nodes : {28, 80, 120}) {
      for (const double radius : {0.3, 0.4, 0.6}) {
        Hive hive =
            hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, radius, nodes), 0.0);
        EXPECT_LT(std::abs(force_error(hive, nu)), 0.02)
            << "nu " << nu << ", " << nodes << " nodes, radius " << radius;
      }
    }
  }
}

TEST(Hive, CoupledForceIsTheGlobalModels) {
  const double nu = 0.45;
  const HemisphereAnswer whole =
      ground(nu).body->press(HemisphereContact::kFrictionless, kTool, kRings);
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.4, 80), 0.0);
  const auto cells = tool(nu);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  EXPECT_NEAR(hive.press(depths_of(cells)).force.z(), whole.force, 0.01 * whole.force);
}

TEST(Hive, CoupledProfileIsTheReferencesWithinItsRadius) {
  const double nu = 0.30;
  const auto references =
      read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  const HemisphereReference* reference = find_reference(*references, nu, kTool);
  const Ground& on = ground(nu);
  Hive hive = hive_at(on, settings_of(nu, HivePeriphery::kCoupled, 0.4, 120), 0.0);
  // Cells as fine as the profile's edge asks for.
  const auto cells = HemisphereBody::cells(HemisphereContact::kFrictionless, nu, kTool, 6, 0.0);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  ASSERT_EQ(hive.press(depths_of(cells)).verdict, HiveVerdict::kSound);
  double error = 0.0, size = 0.0;
  for (int i = 1; i < 40; ++i) {
    const double polar = 0.01 * i;
    const SurfaceSpot spot = on.surface->nearest(on_dome(polar));
    const Vec3 exact =
        kRadius *
        reference->profile(HemisphereContact::kFrictionless).at(spot.position.normalized());
    error += polar * (hive.displacement(spot) - exact).squaredNorm();
    size += polar * exact.squaredNorm();
  }
  EXPECT_LT(std::sqrt(error / size), 0.05);
}

TEST(Hive, BoussinesqIsSofterThanTheBodyAndAHeldPeripheryStiffer) {
  for (const double nu : {0.30, 0.45}) {
    Hive free = hive_at(ground(nu), settings_of(nu, HivePeriphery::kBoussinesq, 0.4, 80), 0.0);
    const double softer = force_error(free, nu);
    EXPECT_LT(softer, -0.02);
    EXPECT_GT(softer, -0.12);
    double last = std::numeric_limits<double>::infinity();
    for (const double radius : {0.3, 0.4, 0.6}) {
      Hive held = hive_at(ground(nu), settings_of(nu, HivePeriphery::kFixed, radius, 80), 0.0);
      const double stiffer = force_error(held, nu);
      EXPECT_GT(stiffer, 0.05);
      EXPECT_LT(stiffer, last);
      last = stiffer;
    }
  }
}

TEST(Hive, OnAFlatDeepBodyBoussinesqIsThePunchWhateverTheNodes) {
  TriangleSurface plane;
  for (int j = 0; j <= 20; ++j)
    for (int i = 0; i <= 20; ++i)
      plane.vertices.emplace_back(0.002 * (i - 10), 0.002 * (j - 10), 0.0);
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) {
      const int v = 21 * j + i;
      plane.triangles.push_back({v, v + 1, v + 22});
      plane.triangles.push_back({v, v + 22, v + 21});
    }
  }
  const auto surface = WalkableSurface::make(plane);
  ASSERT_TRUE(surface);
  const IsotropicMaterial material{10e3, 0.45};
  const double a = 0.001, depth = 0.0005;
  std::vector<ContactCell> cells;
  const CellPattern pattern = fitted_to_punch(ringed_disc(1.0, 3), a, 0.45, false);
  for (std::size_t k = 0; k < pattern.places.size(); ++k) {
    ContactCell cell;
    cell.position = Vec3(pattern.places[k].x(), pattern.places[k].y(), 0.0);
    cell.area = pattern.areas[k];
    cells.push_back(cell);
  }
  for (const int nodes : {14, 80, 200}) {
    HiveSettings settings;
    settings.material = material;
    settings.radius = 0.006;
    settings.nodes = nodes;
    auto hive = Hive::create({&*surface, nullptr, nullptr}, settings, 64);
    ASSERT_TRUE(hive);
    ASSERT_EQ(hive->build(surface->nearest(Vec3::Zero())), HiveVerdict::kSound);
    ASSERT_EQ(hive->seat(cells), HiveVerdict::kSound);
    const std::vector<double> depths(cells.size(), depth);
    EXPECT_NEAR(hive->press(depths).force.z(), 2.0 * material.contact_modulus() * a * depth,
                1e-6 * material.contact_modulus() * a * depth);
  }
}

TEST(Hive, ComplianceIsSymmetricAndPositiveSoThatClosedPathsGiveBackNoEnergy) {
  for (const auto periphery :
       {HivePeriphery::kCoupled, HivePeriphery::kBoussinesq, HivePeriphery::kFixed}) {
    Hive hive = hive_at(ground(0.45), settings_of(0.45, periphery, 0.4, 80), 0.3);
    const auto cells = tool(0.45, 0.32);
    ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
    const MatrixX compliance = hive.compliance();
    EXPECT_EQ((compliance - compliance.transpose()).norm(), 0.0);
    EXPECT_GT(smallest_eigenvalue_ratio(compliance), 0.0);
    // Round a loop of depths: two ways of tilting the tool, a quarter of a turn apart.
    std::vector<double> depths(cells.size()), before;
    double work = 0.0, greatest = 0.0;
    std::vector<double> last_forces;
    constexpr int kSteps = 400;
    for (int step = 0; step <= kSteps; ++step) {
      const double angle = 2.0 * 3.14159265358979 * step / kSteps;
      for (std::size_t k = 0; k < cells.size(); ++k) {
        const Vec3 offset = cells[k].position - hive.centre().position;
        depths[k] = 4e-4 * std::cos(angle) + 0.5 * offset.y() * std::sin(angle) + 1e-4;
      }
      const HiveForce force = hive.press(depths);
      ASSERT_EQ(force.verdict, HiveVerdict::kSound);
      greatest = std::max(greatest, force.energy);
      if (step > 0)
        for (std::size_t k = 0; k < cells.size(); ++k)
          work += 0.5 * (hive.cell_forces()[k] + last_forces[k]) * (depths[k] - before[k]);
      before = depths;
      last_forces.assign(hive.cell_forces().begin(), hive.cell_forces().end());
    }
    EXPECT_LT(std::abs(work), 1e-4 * greatest) << name_of(periphery);
  }
}

TEST(Hive, ForceIsContinuousWhileTheToolSlidesAndAcrossHives) {
  const double nu = 0.45;
  const HiveSettings settings = settings_of(nu, HivePeriphery::kCoupled, 0.4, 80);
  Hive one = hive_at(ground(nu), settings, 0.2), next = hive_at(ground(nu), settings, 0.3);
  double last = 0.0;
  for (int i = 0; i <= 50; ++i) {  // steps of 0.05 mm
    const double tilt = 0.2 + 0.002 * i;
    const auto cells = tool(nu, tilt);
    ASSERT_EQ(one.seat(cells), HiveVerdict::kSound);
    const double force = one.press(depths_of(cells)).force.norm();
    if (i > 0) {
      EXPECT_LT(std::abs(force / last - 1.0), 0.005) << i;
    }
    last = force;
    ASSERT_EQ(next.seat(cells), HiveVerdict::kSound);
    EXPECT_NEAR(next.press(depths_of(cells)).force.norm(), force, 0.01 * force) << i;
  }
}

TEST(Hive, RefusesContactsThatReachItsPeriphery) {
  const double nu = 0.30;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.12, 80), 0.0);
  EXPECT_EQ(hive.seat(tool(nu)), HiveVerdict::kTooWide);
  EXPECT_EQ(hive.press(std::vector<double>(37, 1e-4)).verdict, HiveVerdict::kNotBuilt);
}

TEST(Hive, StandsSmallerWhereTheSurfaceTurnsBackIfTheBodyMovesItsEdge) {
  // Past the rim and the middle of the base.
  const double nu = 0.30;
  auto coupled =
      Hive::create(ground(nu).on(), settings_of(nu, HivePeriphery::kCoupled, 3.5, 120), 127);
  auto alone =
      Hive::create(ground(nu).on(), settings_of(nu, HivePeriphery::kBoussinesq, 3.5, 120), 127);
  ASSERT_TRUE(coupled && alone);
  const SurfaceSpot pole = ground(nu).surface->nearest(on_dome(0.0));
  EXPECT_EQ(alone->build(pole), HiveVerdict::kFolded);
  const double whole = coupled->usable_radius();
  ASSERT_EQ(coupled->build(pole), HiveVerdict::kSound);
  EXPECT_LT(coupled->usable_radius(), 0.75 * whole);
  EXPECT_GT(coupled->usable_radius(), 0.3 * whole);
  EXPECT_LT(std::abs(force_error(*coupled, nu)), 0.06);
  // A state goes on with a smaller one.
  auto other =
      Hive::create(ground(nu).on(), settings_of(nu, HivePeriphery::kCoupled, 3.5, 120), 127);
  ASSERT_TRUE(other);
  other->restore(coupled->state());
  EXPECT_EQ(other->usable_radius(), coupled->usable_radius());
}

TEST(Hive, SaysWhatIsWrongInsteadOfGivingAForce) {
  const double nu = 0.30;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kBoussinesq, 0.4, 80), 0.0);
  auto cells = tool(nu);
  std::vector<double> depths = depths_of(cells);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  depths[3] = std::numeric_limits<double>::quiet_NaN();
  const HiveForce force = hive.press(depths);
  EXPECT_EQ(force.verdict, HiveVerdict::kNotFinite);
  EXPECT_EQ(force.force, Vec3(Vec3::Zero()));
  depths.pop_back();
  EXPECT_EQ(hive.press(depths).verdict, HiveVerdict::kTooMany);
  cells[5].position.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(hive.seat(cells), HiveVerdict::kNotFinite);
  cells = tool(nu);
  cells[5].area = 0.0;
  EXPECT_EQ(hive.seat(cells), HiveVerdict::kNotFinite);
  EXPECT_EQ(hive.seat(std::vector<ContactCell>(128, tool(nu).front())), HiveVerdict::kTooMany);
  EXPECT_EQ(hive.build(SurfaceSpot{}), HiveVerdict::kNotOnSurface);
  EXPECT_EQ(hive.seat(tool(nu)), HiveVerdict::kNotBuilt);
  // A ball's radius deep its layers meet in one point.
  HiveSettings deep = settings_of(nu, HivePeriphery::kBoussinesq, 0.4, 80);
  deep.depth = 1.5 * kRadius;
  auto folded = Hive::create(ground(nu).on(), deep, 64);
  ASSERT_TRUE(folded);
  EXPECT_EQ(folded->build(ground(nu).surface->nearest(on_dome(0.0))), HiveVerdict::kFolded);
}

TEST(Hive, ListsAllMistakesOfItsSettings) {
  HiveSettings settings;
  settings.nodes = 5;
  settings.radius = -1.0;
  settings.periphery = HivePeriphery::kCoupled;
  settings.material = {-1.0, 0.6};
  const auto hive = Hive::create({}, settings, 500);
  ASSERT_FALSE(hive);
  EXPECT_EQ(hive.error().messages.size(), 7u) << hive.error().text();
  settings = settings_of(0.3, HivePeriphery::kCoupled, 0.4, 28);
  settings.formulation = HiveFormulation::kPaper;
  const auto paper = Hive::create(ground(0.3).on(), settings, 64);
  ASSERT_FALSE(paper);
  EXPECT_NE(paper.error().text().find("boussinesq or fixed"), std::string::npos);
}

TEST(Hive, ThePapersSchemeRunsAndIsFarOff) {
  const double nu = 0.30;
  HiveSettings settings = settings_of(nu, HivePeriphery::kFixed, 0.4, 28);
  settings.formulation = HiveFormulation::kPaper;
  Hive hive = hive_at(ground(nu), settings, 0.0);
  EXPECT_GT(std::abs(force_error(hive, nu)), 0.3);
  EXPECT_EQ(hive.figures().unknowns, 84);
}

TEST(Hive, ABodyThatStrainHasSoftenedGivesMoreByThat) {
  const double nu = 0.45;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.4, 80), 0.0);
  const auto cells = tool(nu);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  const MatrixX alone = hive.compliance();
  HoldBlend blend;
  blend.to.centre = on_dome(0.0);
  blend.to.reach = kRadius;
  blend.to.root(2, 0) = 2.0 * std::sqrt(alone.mean());
  blend.to.given = 1;
  ASSERT_TRUE(blend.is_sound());
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  const auto n = static_cast<Eigen::Index>(cells.size()) - 1;
  const double up = cells.front().direction.z() * cells.back().direction.z();
  EXPECT_NEAR(hive.compliance()(0, n), alone(0, n) + 4.0 * alone.mean() * up,
              1e-12 * alone.maxCoeff());
}

// What jaws, springs and other tools hold is taken off between any two cells, half of each of two
// holds while one passes into the other.
TEST(Hive, WhatOthersHoldIsTakenOffTheCellsCompliance) {
  const double nu = 0.45;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.4, 80), 0.0);
  const auto cells = tool(nu);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  const MatrixX alone = hive.compliance();
  const double alone_force = hive.press(depths_of(cells)).force.z();
  HoldBlend blend;
  blend.to.centre = on_dome(0.0);
  blend.to.along_x = Vec3::UnitX();
  blend.to.along_y = Vec3::UnitY();
  blend.to.reach = kRadius;
  // Less up and down, by a third of what the pattern gives in the mean, and less so on one side.
  const double third = std::sqrt(alone.mean() / 3.0);
  blend.to.root(2, 0) = third;
  blend.to.root(5, 0) = -0.5 * third / (kTool * kRadius);
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  const auto taken = [&](const ContactCell& cell) {
    return third * cell.direction.z() *
           (1.0 - 0.5 * (cell.position.x() - blend.to.centre.x()) / (kTool * kRadius));
  };
  double worst = 0.0;
  for (std::size_t k = 0; k < cells.size(); ++k)
    for (std::size_t l = 0; l < cells.size(); ++l) {
      const auto i = static_cast<Eigen::Index>(k), j = static_cast<Eigen::Index>(l);
      const double wanted = alone(i, j) - taken(cells[k]) * taken(cells[l]);
      worst = std::max(worst, std::abs(hive.compliance()(i, j) - wanted));
    }
  EXPECT_LT(worst, 1e-12 * alone.maxCoeff());
  EXPECT_GT(hive.press(depths_of(cells)).force.z(), 1.2 * alone_force);
  blend.share = 0.5;
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  EXPECT_NEAR(hive.compliance()(0, 0), alone(0, 0) - 0.5 * taken(cells[0]) * taken(cells[0]),
              1e-12 * alone(0, 0));
  // More than the tissue has to give: it answers by itself.
  blend.share = 1.0;
  blend.to.root *= 10.0;
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  EXPECT_EQ(hive.compliance()(0, 0), alone(0, 0));
}

/// About the pole: stiffer towards +x, a little taken and a little given.
HoldBlend varied_hold() {
  HoldBlend blend;
  blend.to.centre = on_dome(0.0);
  blend.to.along_x = Vec3::UnitX();
  blend.to.along_y = Vec3::UnitY();
  blend.to.reach = kRadius;
  blend.to.stiffer = Vec3(std::log(4.0), 20.0, -10.0);
  blend.to.least = -1.0;
  blend.to.most = 4.0;
  return blend;
}

TEST(Hive, TissueThatIsStifferByAFactorPressesBackByIt) {
  const double nu = 0.45;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.4, 80), 0.0);
  const auto cells = tool(nu);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  const double alone = hive.press(depths_of(cells)).force.z();
  HoldBlend blend = varied_hold();
  blend.to.stiffer.tail<2>().setZero();
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  EXPECT_NEAR(hive.press(depths_of(cells)).force.z(), 4.0 * alone, 1e-9 * alone);
  // Half of the way compliances are half of each.
  blend.share = 0.5;
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  EXPECT_NEAR(hive.press(depths_of(cells)).force.z(), alone / 0.625, 1e-9 * alone);
  // No more than the bounds say.
  blend.share = 1.0;
  blend.to.most = std::log(2.0);
  ASSERT_EQ(hive.seat(cells, blend), HiveVerdict::kSound);
  EXPECT_NEAR(hive.press(depths_of(cells)).force.z(), 2.0 * alone, 1e-9 * alone);
}

TEST(Hive, AHoldThatVariesDrawsTheToolAsideByWhatTheEnergyFalls) {
  const double nu = 0.45;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.4, 80), 0.0);
  const auto cells = tool(nu);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  const double give = MatrixX(hive.compliance()).mean();
  HoldBlend blend = varied_hold();
  blend.to.root(2, 0) = 0.2 * std::sqrt(give);
  blend.to.root(5, 0) = 0.1 * std::sqrt(give) / kTool;
  blend.to.divided = FootHold::slopes_of(blend.to.root * blend.to.root.transpose());
  const auto energy = [&](const HoldBlend& hold) {
    EXPECT_EQ(hive.seat(cells, hold), HiveVerdict::kSound);
    return hive.press(depths_of(cells)).energy;
  };
  const double step = 1e-4 * kTool;
  for (const double share : {1.0, 0.3}) {
    blend.share = share;
    HoldBlend ahead = blend, behind = blend;
    ahead.to.centre.x() -= step;  // as the tool sees it that has gone on
    behind.to.centre.x() += step;
    const double falls = -(energy(ahead) - energy(behind)) / (2.0 * step);
    const double whole = energy(blend);
    EXPECT_GT(std::abs(falls), 1e-3 * whole / kTool);
    EXPECT_NEAR(hive.drawn_aside().x(), falls, 1e-3 * std::abs(falls));
  }
}

TEST(Hive, AHoldThatChangesDoesTheWorkThatTheEnergyGrowsBy) {
  const double nu = 0.45;
  Hive hive = hive_at(ground(nu), settings_of(nu, HivePeriphery::kCoupled, 0.4, 80), 0.0);
  const auto cells = tool(nu);
  ASSERT_EQ(hive.seat(cells), HiveVerdict::kSound);
  const double give = MatrixX(hive.compliance()).mean();
  HoldBlend before = varied_hold();
  before.to.root(2, 0) = 0.2 * std::sqrt(give);
  HoldBlend now = before;
  now.to.stiffer[0] += 1e-3;
  now.to.root(2, 0) *= 1.001;
  ASSERT_EQ(hive.seat(cells, before), HiveVerdict::kSound);
  const double stored = hive.press(depths_of(cells)).energy;
  ASSERT_EQ(hive.seat(cells, now), HiveVerdict::kSound);
  const double grown = hive.press(depths_of(cells)).energy - stored;
  EXPECT_GT(grown, 5e-4 * stored);
  EXPECT_NEAR(hive.work_of_hold(before), grown, 5e-3 * grown);
}

}  // namespace
}  // namespace viscera
