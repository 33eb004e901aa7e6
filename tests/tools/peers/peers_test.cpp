// Other programs on the same hemisphere; skipped where they aren't installed.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/paths.h"
#include "tools/peers/bent_block_calculix.h"
#include "tools/peers/bullet.h"
#include "tools/peers/finite_elements.h"

namespace viscera {
namespace {

TEST(PeerForces, OfAUniformStrainOnATetrahedronAreItsStressTimesItsFaces) {
  TetrahedralMesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.elements = {{0, 1, 2, 3}};
  constexpr double kStrain = 0.01;  // along z, Poisson's ratio 0: stress E times strain
  std::vector<Vec3> moved;
  for (const Vec3& x : mesh.nodes) moved.emplace_back(0.0, 0.0, kStrain * x.z());
  const auto forces = internal_forces(mesh, 0.0, moved);
  // The slanted face's and the bottom's tractions act in thirds on their corners; together a corner
  // feels V sigma grad(N).
  EXPECT_NEAR(forces[3].z(), kStrain / 6.0, 1e-15);
  EXPECT_NEAR(forces[0].z(), -kStrain / 6.0, 1e-15);
  EXPECT_NEAR((forces[0] + forces[1] + forces[2] + forces[3]).norm(), 0.0, 1e-15);
}

class InstalledPeers : public testing::Test {
 protected:
  void SetUp() override {
    if (!finite_elements_installed()) GTEST_SKIP() << "gmsh or CalculiX isn't installed";
  }
  test::TemporaryFolder folder_;
};

TEST_F(InstalledPeers, FiniteElementsComeNearTheReferenceWithEitherSolver) {
  const auto references =
      read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  ASSERT_TRUE(references) << references.error().text();
  const HemisphereReference& reference = *find_reference(*references, 0.3, 0.2);
  const auto mesh = mesh_hemisphere({true, 0.15, 0.25, 0.3}, folder_.path());
  ASSERT_TRUE(mesh) << mesh.error().text();
  for (const auto solver : {CalculixSolver::kSpooles, CalculixSolver::kIterativeCholesky}) {
    const auto answer = solve_calculix(*mesh, 0.3, 0.2, solver, folder_.path());
    ASSERT_TRUE(answer) << answer.error().text();
    // Edges of 0.15 R under a patch of 0.2 R: a tenth, as the coarse rows of the benchmark.
    EXPECT_NEAR(answer->force_over_ERdelta / reference.stick, 1.0, 0.15);
    EXPECT_LT(
        dome_error(*mesh, answer->displacements, reference.profile(HemisphereContact::kStick)),
        0.15);
  }
}

TEST_F(InstalledPeers, AFittedMeshHasTheContactsRimAsEdges) {
  constexpr double kContact = 0.2;
  for (const bool quadratic : {false, true}) {
    const auto fitted = mesh_hemisphere({quadratic, 0.1, 0.0, 0.25, kContact}, folder_.path());
    ASSERT_TRUE(fitted) << fitted.error().text();
    const auto on_rim = [&](const TetrahedralMesh& mesh) {
      std::size_t count = 0;
      for (const Vec3& x : mesh.nodes)
        count += std::abs(std::hypot(x.x(), x.y()) - kContact) < 1e-6 && x.norm() > 0.999;
      return count;
    };
    // The rim is 1.26 long: a dozen edges at least.
    EXPECT_GE(on_rim(*fitted), 12u);
    const auto plain = mesh_hemisphere({quadratic, 0.1, 0.0, 0.25}, folder_.path());
    ASSERT_TRUE(plain) << plain.error().text();
    EXPECT_LT(on_rim(*plain), 3u);
    // Its patch is a disc up to chords: of the area of nodes that are moved, none lies beyond.
    for (const int node : patch_nodes(*fitted, kContact)) {
      const Vec3& x = fitted->nodes[static_cast<std::size_t>(node)];
      EXPECT_LE(std::hypot(x.x(), x.y()), kContact + 1e-6);
    }
  }
}

TEST_F(InstalledPeers, CalculixSaysWhatAFurtherSolutionTakesBesideItsProcess) {
  const auto mesh = mesh_hemisphere({true, 0.2, 0.0, 0.3, 0.3}, folder_.path());
  ASSERT_TRUE(mesh) << mesh.error().text();
  const auto answer = solve_calculix(*mesh, 0.3, 0.3, CalculixSolver::kSpooles, folder_.path());
  ASSERT_TRUE(answer) << answer.error().text();
  ASSERT_TRUE(answer->own_s);
  EXPECT_GT(*answer->own_s, 0.0);
  // Other work may delay either; they are of one order.
  EXPECT_LT(*answer->own_s, 5.0 * answer->process_s);
}

TEST_F(InstalledPeers, BulletWithoutCorotationComesToRestWhereLinearTetrahedraDo) {
  if (bullet_program().empty()) GTEST_SKIP() << "Bullet isn't installed";
  const auto mesh = mesh_hemisphere({false, 0.25, 0.0, 0.25, 0.3}, folder_.path());
  ASSERT_TRUE(mesh) << mesh.error().text();
  const auto solved = solve_calculix(*mesh, 0.3, 0.3, CalculixSolver::kSpooles, folder_.path());
  ASSERT_TRUE(solved) << solved.error().text();
  const auto off = [&](BulletElasticity elasticity) {
    const auto stepped = step_bullet(*mesh, 0.3, 0.3, elasticity, 300, folder_.path());
    EXPECT_TRUE(stepped) << stepped.error().text();
    double error = 0.0, size = 0.0;
    for (std::size_t n = 0; stepped && n < mesh->nodes.size(); ++n) {
      error += (stepped->displacements[n] - solved->displacements[n]).squaredNorm();
      size += solved->displacements[n].squaredNorm();
    }
    return std::sqrt(error / size);
  };
  const double linear = off(BulletElasticity::kLinear),
               corotated = off(BulletElasticity::kCorotated);
  RecordProperty("linear", std::to_string(linear));
  RecordProperty("corotated", std::to_string(corotated));
  EXPECT_LT(linear, 0.02);
  EXPECT_LT(linear, corotated);
}

TEST_F(InstalledPeers, ForcesOfLinearTetrahedraAreCalculixsReaction) {
  const auto mesh = mesh_hemisphere({false, 0.25, 0.0}, folder_.path());
  ASSERT_TRUE(mesh) << mesh.error().text();
  const auto answer = solve_calculix(*mesh, 0.45, 0.3, CalculixSolver::kSpooles, folder_.path());
  ASSERT_TRUE(answer) << answer.error().text();
  const auto forces = internal_forces(*mesh, 0.45, answer->displacements);
  double reaction = 0.0;
  for (const int node : patch_nodes(*mesh, 0.3))
    reaction -= forces[static_cast<std::size_t>(node)].z() / kHemisphereDepth;
  EXPECT_NEAR(reaction / answer->force_over_ERdelta, 1.0, 1e-4);  // of printed figures
}

TEST_F(InstalledPeers, ABentBlockByCalculixHasTheForceOfOurElementsOfTheSameLaw) {
  BentBlockOptions options;
  options.moved = Vec3(0.0, 0.0, 15e-3);
  options.elements = 8;
  options.steps = 3;
  const auto ours = BentBlock::solve(options);
  ASSERT_TRUE(ours) << ours.error().text();
  const auto peer = bend_by_calculix(options, 12, folder_.path());
  ASSERT_TRUE(peer) << peer.error().text();
  EXPECT_EQ(peer->nodes, 25u * 7 * 7);
  // Cubes of 7 mm are stiffer by some percent.
  EXPECT_LT((peer->force - ours->force()).norm(), 0.04 * ours->force().norm())
      << peer->force.transpose() << " beside " << ours->force().transpose();
}

}  // namespace
}  // namespace viscera
