// The finite elements that references of the body benchmark come from, against closed forms and
// each other.
#include "engine/verification/reference_solid.h"

#include <gtest/gtest.h>

#include <numbers>

#include "engine/verification/hemisphere_reference.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
using Held = std::array<bool, 3>;

double area_of(const QuadMesh& mesh) {
  double area = 0.0;
  for (const auto& element : mesh.elements)
    for (std::size_t p = 0; p < 3; ++p)
      for (std::size_t q = 0; q < 3; ++q) {
        const auto ni = quadratics(kGaussPlaces[p]), nj = quadratics(kGaussPlaces[q]);
        const auto di = quadratic_slopes(kGaussPlaces[p]), dj = quadratic_slopes(kGaussPlaces[q]);
        Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();
        for (std::size_t k = 0; k < 9; ++k) {
          const Vec2 x = mesh.nodes[static_cast<std::size_t>(element[k])];
          jacobian.row(0) += di[k / 3] * nj[k % 3] * x.transpose();
          jacobian.row(1) += ni[k / 3] * dj[k % 3] * x.transpose();
        }
        area += std::abs(jacobian.determinant()) * kGaussWeights[p] * kGaussWeights[q];
      }
  return area;
}

TEST(QuadMesh, PatchesCoverTheirOutlineOnceAndShareNodes) {
  const QuadMesh mesh = disc_in_rectangle({1.2, 5.0, 3.0, {0.05, 1.5, 1.0}, 16});
  EXPECT_NEAR(area_of(mesh), 6.2 * 3.0, 1e-4);
  // Euler: a disc of quadrilaterals with nodes on corners, edges and middles.
  std::size_t on_rim = 0;
  for (const Vec2& x : mesh.nodes) on_rim += std::abs(x.norm() - 1.0) < 1e-9;
  EXPECT_EQ(on_rim, 2u * 16u + 1u);
  EXPECT_NEAR(area_of(disc_in_disc(3.0, {0.05, 1.5, 1.0}, 16)), 4.5 * kPi, 1e-4);
  EXPECT_NEAR(area_of(polar_mesh({0.0, 0.4, 0.8, 1.2, 0.5 * kPi}, {0.0, 0.5, 1.0})), 0.25 * kPi,
              2e-4);
}

TEST(QuadMesh, BordersAreFinestWhereAsked) {
  const auto borders = borders_about(0.0, 8.0, {1.0}, {0.01, 1.5, 1.0});
  EXPECT_EQ(borders.front(), 0.0);
  EXPECT_EQ(borders.back(), 8.0);
  double least = 1.0;
  for (std::size_t i = 1; i < borders.size(); ++i) {
    EXPECT_GT(borders[i], borders[i - 1]);
    least = std::min(least, borders[i] - borders[i - 1]);
    if (borders[i] == 1.0) {
      EXPECT_LE(borders[i] - borders[i - 1], 0.01);
    }
  }
  EXPECT_GT(least, 0.005);
}

TEST(TurnedSolid, ThickSphereUnderPressureIsLames) {
  constexpr double kInner = 0.4, kOuter = 1.0, kPressure = 0.1;
  for (const double nu : {0.3, 0.49}) {
    std::vector<double> angles, radii;
    for (int i = 0; i <= 12; ++i) angles.push_back(0.5 * kPi * i / 12);
    for (int i = 0; i <= 10; ++i) radii.push_back(kInner + (kOuter - kInner) * i / 10);
    const auto solid = turned_solid(polar_mesh(angles, radii), nu);
    SolidConditions conditions;
    conditions.held = [](const Vec3& x) { return Held{false, true, x.z() < 1e-9}; };
    conditions.is_loaded = [](const Vec3& x) { return x.norm() < 1.05 * kInner; };
    conditions.pressure = [](const Vec3&) { return kPressure; };
    const auto answer = solid->solve(conditions);
    ASSERT_TRUE(answer) << answer.error().text();
    const double a3 = std::pow(kInner, 3), b3 = std::pow(kOuter, 3), g = 0.5 / (1.0 + nu);
    const double uniform = kPressure * a3 * (1.0 - 2.0 * nu) / (b3 - a3);
    const double radial = kPressure * a3 * b3 / (4.0 * g * (b3 - a3));
    for (std::size_t n = 0; n < solid->nodes().size(); ++n) {
      const Vec3& x = solid->nodes()[n];
      const Vec3 exact = (uniform + radial / std::pow(x.norm(), 3)) * x;
      EXPECT_NEAR((answer->displacements[n] - exact).norm(), 0.0, 1e-3 * radial / (kInner * kInner))
          << x.transpose();
    }
  }
}

TEST(TurnedSolid, PressedHemisphereIsTheReferences) {
  const auto all = read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  ASSERT_TRUE(all) << all.error().text();
  const double edge = std::asin(0.2);
  auto radii = graded_borders(1.0, {2e-4, 1.8, 0.1});
  for (double& r : radii) r = 1.0 - r;
  std::reverse(radii.begin(), radii.end());
  radii.front() = 0.0;
  const auto solid = turned_solid(
      polar_mesh(borders_about(0.0, 0.5 * kPi, {edge}, {2e-4, 1.8, 0.1}), radii), 0.45);
  SolidConditions conditions;
  const auto in_patch = [](const Vec3& x) {
    return x.z() > 0.5 && x.x() < 0.2 + 1e-9 && x.norm() > 1.0 - 1e-9;
  };
  conditions.is_tool = in_patch;
  conditions.held = [&](const Vec3& x) {
    const bool all = in_patch(x) || x.z() < 1e-9;
    return Held{all, true, all};
  };
  conditions.displacement = [&](const Vec3& x) {
    return in_patch(x) ? Vec3(0.0, 0.0, -kHemisphereDepth) : Vec3(Vec3::Zero());
  };
  const auto answer = solid->solve(conditions);
  ASSERT_TRUE(answer) << answer.error().text();
  EXPECT_NEAR(answer->force / kHemisphereDepth / find_reference(*all, 0.45, 0.2)->stick, 1.0, 3e-3);
}

TEST(TurnedSolid, BallOnADeepBodyIsHertz) {
  constexpr double kBall = 10.0, kContact = 1.0, kSize = 40.0, kNu = 0.45;
  const Grading grading{0.02, 1.5, 4.0};
  const auto solid = turned_solid(rectangle_mesh(borders_about(0.0, kSize, {kContact}, grading),
                                                 borders_about(-kSize, 0.0, {0.0}, grading)),
                                  kNu);
  SolidConditions conditions;
  conditions.held = [](const Vec3& x) {
    const bool far = x.z() < -kSize + 1e-9;
    return Held{far, true, far};
  };
  conditions.is_loaded = [](const Vec3& x) { return x.z() > -1e-9 && x.x() < 3.0; };
  conditions.depth = [](const Vec3& x) {
    return kContact * kContact / kBall - 0.5 * x.x() * x.x() / kBall;
  };
  const auto answer = solid->solve(conditions);
  ASSERT_TRUE(answer) << answer.error().text();
  EXPECT_TRUE(answer->converged);
  const double hertz = 4.0 / 3.0 / (1.0 - kNu * kNu) * std::pow(kContact, 3) / kBall;
  // The body ends 40 contact radii away, sides free: a share of about a / L.
  EXPECT_NEAR(answer->force / hertz, 1.0, 0.03);
}

/// A flat end of radius 1 on a cylinder of radius 3 and height 2 that stands on its held base.
TEST(RaisedSolid, CylinderUnderAFlatEndIsTheTurnedOne) {
  constexpr double kRadius = 3.0, kHeight = 2.0, kNu = 0.45, kDepth = 0.1;
  const Grading grading{0.06, 1.8, 1.0};
  const auto z = borders_about(-kHeight, 0.0, {0.0}, grading);
  const auto turned =
      turned_solid(rectangle_mesh(borders_about(0.0, kRadius, {1.0}, grading), z), kNu);
  const auto raised = raised_solid(disc_in_disc(kRadius, grading, 12), z, kNu);
  SolidConditions flat;
  flat.is_tool = [](const Vec3& x) {
    return x.z() > -1e-9 && std::hypot(x.x(), x.y()) < 1.0 + 1e-6;
  };
  flat.held = [&](const Vec3& x) {
    const bool base = x.z() < -kHeight + 1e-9;
    return Held{base, base || std::abs(x.y()) < 1e-9, base || flat.is_tool(x)};
  };
  flat.displacement = [](const Vec3& x) { return Vec3(0.0, 0.0, x.z() > -1e-9 ? -kDepth : 0.0); };
  const auto one = turned->solve(flat), other = raised->solve(flat);
  ASSERT_TRUE(one && other) << (one ? other.error() : one.error()).text();
  EXPECT_NEAR(2.0 * other->force / one->force, 1.0, 3e-3);
}

TEST(RaisedSolid, LinearFieldsAreExact) {
  const auto solid = raised_solid(disc_in_rectangle({1.2, 2.0, 2.0, {0.2, 1.5, 1.0}, 8}),
                                  {-2.0, -0.7, -0.2, 0.0}, 0.3);
  const Mat3 gradient = (Mat3() << .1, .2, -.3, .05, -.2, .1, .3, .15, .25).finished();
  SolidConditions conditions;
  conditions.held = [](const Vec3& x) {
    const bool outer = x.x() < -1.2 + 1e-9 || x.x() > 2.0 - 1e-9 || x.y() < 1e-9 ||
                       x.y() > 2.0 - 1e-9 || x.z() < -2.0 + 1e-9 || x.z() > -1e-9;
    return Held{outer, outer, outer};
  };
  conditions.displacement = [&](const Vec3& x) { return Vec3(gradient * x); };
  const auto answer = solid->solve(conditions);
  ASSERT_TRUE(answer) << answer.error().text();
  for (std::size_t n = 0; n < solid->nodes().size(); ++n)
    EXPECT_NEAR((answer->displacements[n] - gradient * solid->nodes()[n]).norm(), 0.0, 1e-9);
}

TEST(RaisedSolid, ThinBarBendsAsItsClosedForm) {
  // Length 20, section 2 x 2, held at one end, pressed down by a pressure on a disc of radius 1 at
  // 19: Timoshenko's beam, P l^3 / 3 E I + P l / (k G A) with k of a square, to a per cent.
  constexpr double kNu = 0.3, kArm = 18.5;
  const auto solid = raised_solid(disc_in_rectangle({kArm, 1.5, 1.001, {0.3, 1.5, 2.0}, 8}),
                                  {-2.0, -1.0, -0.4, 0.0}, kNu);
  SolidConditions conditions;
  conditions.held = [](const Vec3& x) {
    const bool end = x.x() < -kArm + 1e-9;
    return Held{end, end || x.y() < 1e-9, end};
  };
  conditions.is_loaded = [](const Vec3& x) { return std::hypot(x.x(), x.y()) < 1.0; };
  conditions.pressure = [](const Vec3&) { return 1e-3; };
  const auto answer = solid->solve(conditions);
  ASSERT_TRUE(answer) << answer.error().text();
  const double width = 2.002, inertia = width * 8.0 / 12.0, force = 2.0 * answer->force;
  EXPECT_NEAR(force, 1e-3 * kPi, 1e-5);
  double down = 0.0;
  int count = 0;
  for (std::size_t n = 0; n < solid->nodes().size(); ++n) {
    const Vec3& x = solid->nodes()[n];
    if (std::abs(x.x()) > 1e-6 || std::abs(x.z() + 2.0) > 1e-9) continue;
    down -= answer->displacements[n].z();
    ++count;
  }
  ASSERT_GT(count, 0);
  const double exact = force * std::pow(kArm, 3) / (3.0 * inertia) +
                       force * kArm * 2.0 * (1.0 + kNu) * 1.2 / (2.0 * width);
  EXPECT_NEAR(down / count / exact, 1.0, 0.015);
}

TEST(RaisedSolid, RefusesContact) {
  const auto solid =
      raised_solid(disc_in_rectangle({1.2, 2.0, 2.0, {0.5, 1.5, 1.0}, 8}), {-2.0, 0.0}, 0.3);
  SolidConditions conditions;
  conditions.held = [](const Vec3&) { return Held{true, true, true}; };
  conditions.depth = [](const Vec3&) { return 0.1; };
  EXPECT_FALSE(solid->solve(conditions));
}

TEST(ReferenceSolid, RefusesABodyThatNothingHolds) {
  const auto solid =
      raised_solid(disc_in_rectangle({1.2, 2.0, 2.0, {0.5, 1.5, 1.0}, 8}), {-2.0, 0.0}, 0.3);
  SolidConditions conditions;
  conditions.held = [](const Vec3&) { return Held{}; };
  EXPECT_FALSE(solid->solve(conditions));
}

}  // namespace
}  // namespace viscera
