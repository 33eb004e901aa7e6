// A half-space under a pressure p0 sqrt(1 - r^2 / a^2) on a disc [Johnson1985] ch. 3.4, as a block
// whose other faces are moved as the half-space moves there.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tests/kernels/contact/bodies.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPressure = 500.0, kContact = 8e-3;

/// Displacement under a point force down the outward normal z [Boussinesq1885]; x from the load.
Vec3 boussinesq(const IsotropicMaterial& material, double force, const Vec3& x) {
  const double depth = -x.z(), r = std::hypot(x.x(), x.y()), distance = x.norm();
  const double scale = force / (4.0 * kPi * material.shear_modulus());
  const double radial =
      scale * (r * depth / std::pow(distance, 3) -
               (1.0 - 2.0 * material.poisson_ratio) * r / (distance * (distance + depth)));
  const double down = scale * (depth * depth / std::pow(distance, 3) +
                               2.0 * (1.0 - material.poisson_ratio) / distance);
  return {r > 0.0 ? radial * x.x() / r : 0.0, r > 0.0 ? radial * x.y() / r : 0.0, -down};
}

class Boussinesq : public ::testing::TestWithParam<double> {};

TEST_P(Boussinesq, SurfaceSinksAsThatOfTheHalfSpace) {
  const IsotropicMaterial tissue{1e4, GetParam()};
  const double width = 0.08, height = 0.04,
               force = 2.0 / 3.0 * kPressure * kPi * kContact * kContact;
  const Vec3 load(0.0, 0.0, 0.5 * height);
  const TriangleSurface surface = test::box(Vec3(width, width, height), 24);
  const auto cloud = place_nodes(surface, SurfaceTree(surface),
                                 graded_spacing(8e-3, 2e-3, 0.2, {load}), {}, no_progress());
  ASSERT_TRUE(cloud) << cloud.error().text();
  const Formulation& galerkin = *find_formulation("galerkin");
  const ElasticProblem problem{&surface, &*cloud, tissue,
                               [&](const Vec3& x) { return x.z() < load.z() - 1e-9; }};
  StaticLoads loads;
  loads.traction = [&](const Vec3& x, const Vec3& normal) -> Vec3 {
    const double share = 1.0 - (x - load).squaredNorm() / (kContact * kContact);
    return share > 0.0 ? Vec3(-kPressure * std::sqrt(share) * normal) : Vec3::Zero();
  };
  loads.held_displacement = [&](const Vec3& x) { return boussinesq(tissue, force, x - load); };
  const auto unknowns = solve_static(galerkin, problem, loads);
  ASSERT_TRUE(unknowns) << unknowns.error().text();

  const ShapeFunctions fields = galerkin.fields(*cloud);
  ShapeValues at;
  const auto sunk = [&](double r) {
    EXPECT_TRUE(fields.evaluate(load + Vec3(0.8 * r, 0.6 * r, 0.0), false, at));
    double z = 0.0;
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      z -= at.values[j] * (*unknowns)[3 * static_cast<std::size_t>(at.nodes[j]) + 2];
    }
    return z;
  };
  // The held faces get the point's field for the disc's: (2/5) (a / R)^2 / 2 of what moves there,
  // which is 4 a / (3 pi R) of the middle: 1e-3 with R = 40 mm. Linear fields of spacing h miss
  // about (h / a)^2 / 10 of a load that bends over a: 1 %; so does the pressure's integral.
  const double modulus = tissue.contact_modulus();
  const double middle = kPi * kPressure * kContact / (2.0 * modulus);
  for (const double share : {0.0, 0.5, 0.9}) {
    EXPECT_NEAR(sunk(share * kContact) / middle, 1.0 - 0.5 * share * share, 0.03) << share;
  }
  for (const double r : {16e-3, 24e-3}) {
    const double k = kContact / r;
    const double exact = kPressure / (2.0 * modulus * kContact) *
                         ((2.0 * kContact * kContact - r * r) * std::asin(k) +
                          r * kContact * std::sqrt(1.0 - k * k));
    EXPECT_NEAR(sunk(r) / exact, 1.0, 0.04) << "r " << r;
    EXPECT_NEAR(exact / (force / (kPi * modulus * r)), 1.0, 0.1);  // nearly the point's by now
  }
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, Boussinesq, ::testing::Values(0.3, 0.45));

}  // namespace
}  // namespace viscera
