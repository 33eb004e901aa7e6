// A cantilever bent by a parabolic shear at its end (Timoshenko and Goodier), in plane strain.
#include <gtest/gtest.h>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

/// Length along x, depth along y about 0, P per unit width; the stresses sigma_x = -P (L - x) y /
/// I, tau_xy = P (D^2/4 - y^2) / (2 I), sigma_y = 0, and sigma_z = nu sigma_x that keeps the strain
/// plane. Exact on any body under its own tractions, here on all faces but the held one.
struct Cantilever {
  IsotropicMaterial material;
  double length = 5.0, depth = 1.0, load = 1.0;

  double inertia() const { return depth * depth * depth / 12.0; }
  double plane_modulus() const {
    return material.youngs_modulus / (1.0 - material.poisson_ratio * material.poisson_ratio);
  }
  double plane_ratio() const { return material.poisson_ratio / (1.0 - material.poisson_ratio); }

  Vec3 operator()(const Vec3& at) const {
    const double x = at.x(), y = at.y(), nu = plane_ratio(), d2 = depth * depth;
    const double scale = load / (6.0 * plane_modulus() * inertia());
    return {-scale * y * ((6.0 * length - 3.0 * x) * x + (2.0 + nu) * (y * y - d2 / 4.0)),
            scale * (3.0 * nu * y * y * (length - x) + (4.0 + 5.0 * nu) * d2 * x / 4.0 +
                     (3.0 * length - x) * x * x),
            0.0};
  }

  Mat3 stress(const Vec3& at) const {
    Mat3 sigma = Mat3::Zero();
    sigma(0, 0) = -load * (length - at.x()) * at.y() / inertia();
    sigma(2, 2) = material.poisson_ratio * sigma(0, 0);
    sigma(0, 1) = sigma(1, 0) = load / (2.0 * inertia()) * (depth * depth / 4.0 - at.y() * at.y());
    return sigma;
  }

  StaticLoads loads() const {
    const Cantilever self = *this;
    return {.body_force = {},
            .traction = [self](const Vec3& x, const Vec3& n) { return Vec3(self.stress(x) * n); },
            .held_displacement = self};
  }
};

/// Error of the tip's deflection, relative.
double tip_error(double poisson_ratio, double spacing, const Formulation& formulation) {
  const Cantilever exact{{1e4, poisson_ratio}};
  TriangleSurface beam = test::cube(1.0, 2);
  for (Vec3& x : beam.vertices) x = Vec3(exact.length * (x.x() + 0.5), x.y(), x.z());
  const test::Body body =
      test::placed_body(std::move(beam), [spacing](const Vec3&) { return spacing; });
  const auto system = GalerkinSystem::assemble(
      body.problem(exact.material, [](const Vec3& x) { return x.x() < 1e-9; }), formulation.basis(),
      formulation.support_factor(), no_progress());
  if (!system) return std::numeric_limits<double>::infinity();
  const auto unknowns = system->solve(exact.loads());
  if (!unknowns) return std::numeric_limits<double>::infinity();
  const Vec3 tip(exact.length, 0.0, 0.0);
  return (system->displacement(*unknowns, tip) - exact(tip)).norm() / exact(tip).norm();
}

TEST(Cantilever, BendsAsInTheClosedFormWithFourSpacingsOfDepth) {
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const double error = tip_error(poisson, 0.25, galerkin_formulation());
    RecordProperty("error_at_" + std::to_string(poisson), std::to_string(error));
    EXPECT_LT(error, 0.02) << poisson;
  }
}

TEST(Cantilever, QuadraticBasisLeavesTheCubicPartOnly) {
  const double error = tip_error(0.3, 0.25, galerkin_quadratic_formulation());
  RecordProperty("error", std::to_string(error));
  EXPECT_LT(error, 1e-3);
}

}  // namespace
}  // namespace viscera
