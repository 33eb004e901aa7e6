// Bodies with air between their parts: what one part does is no concern of the other.
#include "kernels/paff/true_neighbours.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

constexpr double kSupport = 1.8;  // that of `galerkin`

/// Two leaves on a root that is held all around; a shear load on the end of the upper one pulls it
/// away from the lower.
struct BentLeaves {
  Vec3 size{40e-3, 10e-3, 4e-3};
  double gap = 0.6e-3, root = 4e-3, load = 1e-4;
  IsotropicMaterial material{1e4, 0.3};

  /// A beam that is clamped at the root, with Timoshenko's shear.
  double expected() const {
    const double area = size.y() * size.z(), inertia = area * size.z() * size.z() / 12.0;
    return load * std::pow(size.x(), 3) / (3.0 * material.youngs_modulus * inertia) +
           load * size.x() / (5.0 / 6.0 * material.shear_modulus() * area);
  }

  struct Answer {
    double loaded = 0.0, other = 0.0;  // tips [m]
    std::size_t nodes = 0, twins = 0;
  };
  Result<Answer> bend(double spacing) const {
    const test::Body body = test::placed_body(test::leaves(size, gap, root, spacing),
                                              [&](const Vec3&) { return spacing; });
    const auto system =
        GalerkinSystem::assemble(body.problem(material, [](const Vec3& x) { return x.x() < 1e-9; }),
                                 kSupport, no_progress());
    if (!system) return std::unexpected(system.error());
    const Vec3 traction(0.0, 0.0, load / (size.y() * size.z()));
    const auto unknowns = system->solve({.body_force = {},
                                         .traction = [&](const Vec3& x, const Vec3&) -> Vec3 {
                                           return x.x() > size.x() - 1e-9 && x.z() > 0.0
                                                      ? traction
                                                      : Vec3(Vec3::Zero());
                                         },
                                         .held_displacement = {}});
    if (!unknowns) return std::unexpected(unknowns.error());
    const Vec3 tip(size.x(), 0.0, 0.5 * (gap + size.z()));
    return Answer{system->displacement(*unknowns, tip).z(),
                  system->displacement(*unknowns, {tip.x(), tip.y(), -tip.z()}).norm(),
                  body.cloud.size(), system->figures().twins};
  }
};

TEST(Leaves, BendAsBeamsOfTheirOwnAThirdOfASpacingApart) {
  for (const double poisson : {0.3, 0.45}) {
    BentLeaves leaves;
    leaves.material.poisson_ratio = poisson;
    EXPECT_NEAR(leaves.expected(), 4.03e-3, 0.01e-3);
    const auto answer = leaves.bend(2e-3);
    ASSERT_TRUE(answer) << answer.error().text();
    RecordProperty("tip_mm_at_" + std::to_string(poisson), std::to_string(1e3 * answer->loaded));
    RecordProperty("other_mm_at_" + std::to_string(poisson), std::to_string(1e3 * answer->other));
    RecordProperty("nodes", std::to_string(answer->nodes));
    RecordProperty("twins", std::to_string(answer->twins));
    EXPECT_NEAR(answer->loaded / leaves.expected(), 1.0, 0.06) << poisson;
    EXPECT_LT(answer->other, 0.02 * answer->loaded) << poisson;
  }
}

TEST(Leaves, DoSoWhateverTheGap) {
  // From a hundredth of a spacing to what no field reaches across.
  for (const double gap : {0.02e-3, 0.2e-3, 2e-3, 8e-3}) {
    BentLeaves leaves;
    leaves.gap = gap;
    const auto answer = leaves.bend(2e-3);
    ASSERT_TRUE(answer) << gap << ": " << answer.error().text();
    RecordProperty("tip_mm_gap_" + std::to_string(1e3 * gap), std::to_string(1e3 * answer->loaded));
    EXPECT_NEAR(answer->loaded / leaves.expected(), 1.0, 0.06) << gap;
    EXPECT_LT(answer->other, 0.02 * answer->loaded) << gap;
  }
}

TEST(Leaves, CarryALinearFieldExactly) {
  const BentLeaves leaves;
  const test::Body body = test::placed_body(
      test::leaves(leaves.size, leaves.gap, leaves.root, 2e-3), [](const Vec3&) { return 2e-3; });
  const auto system = GalerkinSystem::assemble(
      body.problem(leaves.material, [](const Vec3& x) { return x.x() < 1e-9; }), kSupport,
      no_progress());
  ASSERT_TRUE(system) << system.error().text();
  ASSERT_GT(system->figures().twins, 0u);
  const test::LinearField field;
  const auto unknowns = system->solve(field.loads(leaves.material));
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  EXPECT_LT(test::largest_error(*system, *unknowns, field), 1e-8);
}

/// Edge 20 mm, h 4 mm, 0.3 h apart.
struct TwoCubes {
  static constexpr double kEdge = 20e-3, kSpacing = 4e-3, kGap = 0.3 * kSpacing;
  test::Body body =
      test::placed_body(test::two_cubes(kEdge, kGap, 5), [](const Vec3&) { return kSpacing; });
  IsotropicMaterial material{5e3, 0.45};

  static bool is_base(const Vec3& x) { return x.z() < -0.5 * kEdge + 1e-9; }
  static bool is_first_base(const Vec3& x) { return is_base(x) && x.x() < 0.5 * kGap; }
};

TEST(TwoCubes, AreRefusedWhereOneIsNotHeldWithItsNodesAndPlace) {
  const TwoCubes cubes;
  const auto solver = galerkin_formulation().prepare(
      cubes.body.problem(cubes.material, TwoCubes::is_first_base), no_progress());
  ASSERT_FALSE(solver);
  const std::string text = solver.error().text();
  EXPECT_NE(text.find("of the body's 2 separate pieces 1 isn't held, with "), std::string::npos)
      << text;
  // Its middle lies at 11.2 mm.
  const auto at = text.find(" nodes about (");
  ASSERT_NE(at, std::string::npos) << text;
  EXPECT_NEAR(std::stod(text.substr(at + 14)), 11.2, 0.5) << text;
  EXPECT_NE(text.find("expected every piece to be held"), std::string::npos) << text;
}

TEST(TwoCubes, LeaveThePieceThatNothingHoldsFreeOfAnyForce) {
  const TwoCubes cubes;
  ElasticProblem problem = cubes.body.problem(cubes.material, TwoCubes::is_first_base);
  problem.may_have_free_pieces = true;
  const auto system = GalerkinSystem::assemble(problem, kSupport, no_progress());
  ASSERT_TRUE(system) << system.error().text();
  ASSERT_EQ(system->pieces().size(), 2u);
  EXPECT_NE(system->pieces()[0].held, system->pieces()[1].held);
  const TissuePiece& free = system->pieces()[system->pieces()[0].held ? 1 : 0];
  const std::vector<Vec3>& nodes = system->fields().cloud().positions;

  // A rotation and a shift of the free one, the other at rest: no force anywhere.
  const SymmetricBlockMatrix& stiffness = system->stiffness();
  std::vector<Vec3> moved(nodes.size(), Vec3::Zero()), force(nodes.size(), Vec3::Zero());
  for (const int node : free.nodes) {
    const auto i = static_cast<std::size_t>(node);
    moved[i] = Vec3(1e-3, 2e-3, -1e-3) + Vec3(0.2, -0.1, 0.3).cross(nodes[i]);
  }
  double largest = 0.0;
  using Block = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;
  for (std::size_t row = 0; row < nodes.size(); ++row)
    for (std::size_t e = stiffness.pattern.row_begin[row]; e < stiffness.pattern.row_begin[row + 1];
         ++e) {
      const auto column = static_cast<std::size_t>(stiffness.pattern.columns[e]);
      const Block block(stiffness.blocks.data() + 9 * e);
      force[row] += block * moved[column];
      if (column != row) force[column] += block.transpose() * moved[row];
      largest = std::max(largest, block.norm() * 5e-3);
    }
  double greatest = 0.0;
  for (const Vec3& one : force) greatest = std::max(greatest, one.norm());
  RecordProperty("force_over_stiffness", std::to_string(greatest / largest));
  EXPECT_LT(greatest, 1e-12 * largest);
}

TEST(TwoCubes, DoNotFeelEachOtherWhereBothAreHeld) {
  const TwoCubes cubes;
  const auto system = GalerkinSystem::assemble(
      cubes.body.problem(cubes.material, TwoCubes::is_base), kSupport, no_progress());
  ASSERT_TRUE(system) << system.error().text();
  const auto pressed = [](const Vec3& x, const Vec3& n) -> Vec3 {
    return n.z() > 0.9 && x.x() < 0.5 * TwoCubes::kGap ? Vec3(0, 0, -100.0) : Vec3(0, 0, 0);
  };
  const StaticLoads loads{.body_force = {}, .traction = pressed, .held_displacement = {}};
  const auto unknowns = system->solve(loads);
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  const auto top = [](double x) { return Vec3(x, 0.0, 0.5 * TwoCubes::kEdge); };
  const double sunk = system->displacement(*unknowns, top(-0.5 * TwoCubes::kEdge)).z();
  EXPECT_LT(sunk, -1e-5);
  for (const double x : {TwoCubes::kGap, TwoCubes::kGap + 0.5 * TwoCubes::kEdge})
    EXPECT_LT(system->displacement(*unknowns, top(x)).norm(), 1e-12 * -sunk) << x;

  // As deep as a cube alone.
  TriangleSurface one = test::cube(TwoCubes::kEdge, 5);
  for (Vec3& v : one.vertices) v.x() -= 0.5 * TwoCubes::kEdge;
  const test::Body alone =
      test::placed_body(std::move(one), [](const Vec3&) { return TwoCubes::kSpacing; });
  const auto reference = GalerkinSystem::assemble(alone.problem(cubes.material, TwoCubes::is_base),
                                                  kSupport, no_progress());
  ASSERT_TRUE(reference) << reference.error().text();
  const auto expected = reference->solve(loads);
  ASSERT_TRUE(expected) << expected.error().text();
  EXPECT_NEAR(sunk / reference->displacement(*expected, top(-0.5 * TwoCubes::kEdge)).z(), 1.0,
              0.02);
}

}  // namespace
}  // namespace viscera
