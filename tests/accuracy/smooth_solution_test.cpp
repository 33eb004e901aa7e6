// A smooth solution on a cube with body force, tractions and a held face: the error and its order.
#include "engine/verification/smooth_solution.h"

#include <gtest/gtest.h>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

/// Relative L2 error of the displacement over the nodes.
double error_of(int cells, double poisson_ratio, double support_factor,
                Basis basis = Basis::kLinear) {
  const IsotropicMaterial material{1.0, poisson_ratio};
  const SmoothSolution exact(material);
  const test::Body body = test::jittered_cube(cells, 0.2);
  const auto system = GalerkinSystem::assemble(body.problem(material, SmoothSolution::is_fixed),
                                               basis, support_factor, no_progress());
  if (!system) return std::numeric_limits<double>::infinity();
  const auto unknowns = system->solve(exact.loads());
  if (!unknowns) return std::numeric_limits<double>::infinity();
  double error = 0.0, size = 0.0;
  for (const Vec3& x : body.cloud.positions) {
    error += (system->displacement(*unknowns, x) - exact.displacement(x)).squaredNorm();
    size += exact.displacement(x).squaredNorm();
  }
  return std::sqrt(error / size);
}

TEST(SmoothSolution, ConvergesAtSecondOrderWithNarrowSupport) {
  const double coarse = error_of(7, 0.3, 1.6), fine = error_of(10, 0.3, 1.6);
  RecordProperty("error_8_nodes", std::to_string(coarse));
  RecordProperty("error_11_nodes", std::to_string(fine));
  EXPECT_LT(coarse, 0.0080);
  EXPECT_LT(fine, 0.0034);
  EXPECT_GT(std::log(coarse / fine) / std::log(10.0 / 7.0), 1.8);
}

TEST(SmoothSolution, IsAccurateWithTheFormulationsOwnSupport) {
  EXPECT_LT(error_of(10, 0.30, galerkin_formulation().support_factor()), 0.0022);
}

TEST(SmoothSolution, StaysAccurateNearIncompressibility) {
  EXPECT_LT(error_of(10, 0.49, galerkin_formulation().support_factor()), 0.008);
}

// Ten-node finite elements need 1,331 nodes for 0.0012 on this problem.
TEST(SmoothSolution, ConvergesAtThirdOrderWithQuadraticBasis) {
  const double support = galerkin_quadratic_formulation().support_factor();
  const double coarse = error_of(5, 0.3, support, Basis::kQuadratic);
  const double fine = error_of(8, 0.3, support, Basis::kQuadratic);
  RecordProperty("error_6_nodes", std::to_string(coarse));
  RecordProperty("error_9_nodes", std::to_string(fine));
  EXPECT_LT(fine, 0.0006);
  EXPECT_GT(std::log(coarse / fine) / std::log(8.0 / 5.0), 2.7);
}

}  // namespace
}  // namespace viscera
