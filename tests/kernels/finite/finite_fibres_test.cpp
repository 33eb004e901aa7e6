// Tissue with fibres: its energy, its linear stiffness, and bars that are pulled along and across.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "kernels/finite/fibre_law.h"
#include "kernels/finite/finite_body.h"
#include "kernels/paff/problem_checks.h"
#include "tests/kernels/finite/finite_cube.h"

namespace viscera {
namespace {

constexpr double kYoungs = 10e3;  // of the cube
constexpr double kFibres = 80e3;  // of fibres in it [Pa]

std::function<Fibres(const Vec3&, double)> even(const Vec3& direction, double modulus = kFibres) {
  return [fibres = Fibres{direction.normalized(), modulus}](const Vec3&, double) { return fibres; };
}

/// About the z axis, stiffer towards one end, none at the other.
Fibres winding(const Vec3& x, double) {
  const Vec3 about = Vec3(-x.y() - 0.2, x.x() + 0.7, 0.3).normalized();
  return {about, std::max(0.0, kFibres * (x.z() + 0.3))};
}

double stiffer_end(const Vec3& x, double) {
  return x.x() > 0.1 ? 6.0 : 1.0;
}

double work(std::span<const double> forces, std::span<const double> way) {
  double sum = 0.0;
  for (std::size_t i = 0; i < forces.size(); ++i) sum += forces[i] * way[i];
  return sum;
}

std::vector<double> on_the_way(std::span<const double> u, std::span<const double> way,
                               double step) {
  std::vector<double> there(u.begin(), u.end());
  for (std::size_t i = 0; i < there.size(); ++i) there[i] += step * way[i];
  return there;
}

TEST(FibreLaw, IsTheDerivativeOfItsEnergyWhicheverWayFibresGo) {
  const FibreLaw law = FibreLaw::of(kFibres, 4e3);
  const double step = 1e-5;
  for (const double s : {-1.0, -0.6, -0.1, -0.02, 0.0, 0.02, 0.5, 2.0}) {
    EXPECT_NEAR((law.energy(s + step) - law.energy(s - step)) / (2.0 * step), law.slope(s),
                1e-6 * kFibres)
        << s;
    EXPECT_NEAR((law.slope(s + step) - law.slope(s - step)) / (2.0 * step), law.curvature(s),
                1e-5 * kFibres)
        << s;
  }
  EXPECT_DOUBLE_EQ(law.curvature(0.0), 0.25 * kFibres);
  EXPECT_DOUBLE_EQ(law.slope(0.4), 0.1 * kFibres);
}

TEST(FibreLaw, PressedFibresBuckleBelowTheShearModulusOfWhatTheyLieIn) {
  const double mu = 4e3;
  for (const double modulus : {1e3, 1e5, 1e7}) {
    const FibreLaw law = FibreLaw::of(modulus, mu);
    double least = 0.0;
    for (double s = -1.0; s < 0.0; s += 1e-3) least = std::min(least, 2.0 * law.slope(s));
    EXPECT_GT(least, -kBuckling * mu) << modulus;
    EXPECT_GT(law.curvature(-1.0), 0.0);
  }
  EXPECT_LT(2.0 * FibreLaw::of(1e7, mu).slope(-0.1), -0.99 * kBuckling * mu);
}

class FiniteFibres : public testing::TestWithParam<double> {};

TEST_P(FiniteFibres, TheTangentAtRestIsTheLinearStiffness) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_end, winding);
  const std::vector<double> rest(3 * cube.finite.nodes(), 0.0);
  const std::vector<double> v = random_vector(rest.size(), 1.0, 2);
  std::vector<double> one(v.size()), other(v.size()), bare(v.size());
  cube.finite.tangent(rest).multiply(v, one);
  cube.system.stiffness().multiply(v, other);
  Cube::make(GetParam(), true, stiffer_end).system.stiffness().multiply(v, bare);
  EXPECT_LT(distance(one, other), kSingle * norm(other));
  EXPECT_GT(distance(bare, other), 0.1 * norm(other));
}

TEST_P(FiniteFibres, SmallDisplacementsMeetTheForcesOfTheLinearBody) {
  const Cube cube = Cube::make(GetParam(), true, {}, winding);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 1e-9, 1);
  std::vector<double> linear(u.size());
  cube.system.stiffness().multiply(u, linear);
  EXPECT_LT(distance(cube.gradient(u), linear), 1e-7 * norm(linear));
}

TEST_P(FiniteFibres, ForcesAreTheDerivativeOfTheEnergy) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_end, winding);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.04, 3);
  const std::vector<double> way = random_vector(u.size(), 1.0, 4);
  const std::vector<double> g = cube.gradient(u);
  const double step = 1e-6, difference = (cube.energy(on_the_way(u, way, step)) -
                                          cube.energy(on_the_way(u, way, -step))) /
                                         (2.0 * step);
  EXPECT_NEAR(difference, work(g, way), 1e-7 * norm(g) * norm(way));
}

TEST_P(FiniteFibres, TheTangentIsTheDerivativeOfTheForces) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_end, winding);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.04, 5);
  const std::vector<double> way = random_vector(u.size(), 1.0, 6);
  std::vector<double> exact(u.size());
  cube.finite.tangent(u).multiply(way, exact);
  const double step = 1e-6;
  std::vector<double> difference = cube.gradient(on_the_way(u, way, step));
  const std::vector<double> before = cube.gradient(on_the_way(u, way, -step));
  for (std::size_t i = 0; i < u.size(); ++i)
    difference[i] = (difference[i] - before[i]) / (2.0 * step);
  EXPECT_LT(distance(difference, exact), 1e-7 * norm(exact));
}

TEST_P(FiniteFibres, TheTangentTimesAVectorIsWhatForcesChangeByInChangedTissueToo) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_end, winding);
  TissueChange change;
  for (std::size_t q = 0; q < cube.finite.points(); ++q) {
    change.stiffness.push_back(1.0 + 0.01 * static_cast<double>(q % 50));
    change.shrinkage.push_back(0.002 * static_cast<double>(q % 30));
  }
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.05, 4),
                            d = random_vector(u.size(), 1.0, 5);
  const auto n = static_cast<Eigen::Index>(u.size());
  for (const ChangedTissue& changed : {ChangedTissue(), cube.finite.changed(change)}) {
    const auto gradient = [&](double along) {
      std::vector<double> at = u;
      for (std::size_t i = 0; i < at.size(); ++i) at[i] += along * d[i];
      VectorX g = VectorX::Zero(n);
      FiniteBody::Workspace workspace;
      cube.finite.energy(at, {g.data(), at.size()}, workspace, {}, changed);
      return g;
    };
    constexpr double kStep = 1e-5;
    const VectorX expected = (gradient(kStep) - gradient(-kStep)) / (2.0 * kStep);
    const MatrixX product = cube.finite.tangent_times(cube.finite.point_tangents(u, changed),
                                                      Eigen::Map<const VectorX>(d.data(), n));
    EXPECT_LT((product.col(0) - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST_P(FiniteFibres, TurningABodyTurnsItsForcesAndKeepsItsEnergy) {
  const Cube cube = Cube::make(GetParam(), false, {}, winding);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 7);
  const Mat3 turn = Eigen::AngleAxisd(1.9, Vec3(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  std::vector<double> turned(u.size()), forces = cube.gradient(u);
  for (std::size_t node = 0; node < cube.finite.nodes(); ++node) {
    const Vec3& x = cube.body.cloud.positions[node];
    Vec3::Map(turned.data() + 3 * node) = turn * (x + Vec3::Map(u.data() + 3 * node)) - x;
    Vec3::Map(forces.data() + 3 * node) = turn * Vec3(Vec3::Map(forces.data() + 3 * node));
  }
  EXPECT_NEAR(cube.energy(turned), cube.energy(u), 2.0 * kSingle * cube.energy(u));
  EXPECT_LT(distance(cube.gradient(turned), forces), 4.0 * kSingle * norm(forces));
}

TEST_P(FiniteFibres, AnEvenStrainOfAHeldBodyIsExact) {
  const Vec3 direction = Vec3(2.0, 1.0, -0.5).normalized();
  const Cube cube = Cube::make(GetParam(), true, {}, even(direction));
  Mat3 strain;
  strain << 0.02, 0.01, -0.01, 0.01, -0.03, 0.02, -0.01, 0.02, 0.01;
  const IsotropicMaterial tissue{kYoungs, GetParam()};
  const Mat3 stress =
      2.0 * tissue.shear_modulus() * strain +
      tissue.lame_lambda() * strain.trace() * Mat3::Identity() +
      kFibres * direction.dot(strain * direction) * direction * direction.transpose();
  const auto u = cube.system.solve(
      {.body_force = {},
       .traction = [&](const Vec3&, const Vec3& normal) { return Vec3(stress * normal); },
       .held_displacement = [&](const Vec3& x) { return Vec3(strain * x); }});
  ASSERT_TRUE(u) << u.error().text();
  const std::vector<double> exact = cube.moved([&](const Vec3& x) { return Vec3(x + strain * x); });
  EXPECT_LT(distance(*u, exact), 1e-9 * norm(exact));
}

TEST_P(FiniteFibres, ChangedTissueOfSmallStrainsIsThatOfTheLinearBody) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_end, winding);
  const auto region = cube.system.region([](const Vec3&) { return true; });
  ASSERT_TRUE(region);
  const double scale = 1e-7;
  TissueChange change;
  std::vector<double> strains;
  for (std::size_t q = 0; q < cube.finite.points(); ++q) {
    change.stiffness.push_back(1.0 + static_cast<double>(q % 5));
    change.shrinkage.push_back(scale * static_cast<double>(q % 7));
    strains.push_back(-change.shrinkage.back());
  }
  SymmetricBlockMatrix stiffness = cube.system.stiffness();
  add_stiffness(*region, change.stiffness, stiffness);
  const VectorX load = eigenstrain_load(*region, change.stiffness, strains);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), scale, 16);
  std::vector<double> linear(u.size()), forces(u.size(), 0.0);
  stiffness.multiply(u, linear);
  for (std::size_t i = 0; i < region->nodes.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      linear[3 * static_cast<std::size_t>(region->nodes[i]) + k] -=
          load[static_cast<Eigen::Index>(3 * i + k)];
  FiniteBody::Workspace workspace;
  cube.finite.energy(u, forces, workspace, {}, cube.finite.changed(change));
  EXPECT_LT(distance(forces, linear), 1e-5 * norm(linear));
}

TEST_P(FiniteFibres, ForcesOfChangedRelaxingTissueAreTheDerivativeOfItsEnergy) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_end, winding);
  const std::size_t n = 3 * cube.finite.nodes();
  TissueChange change{random_vector(cube.finite.points(), 1.0, 2),
                      random_vector(cube.finite.points(), 0.03, 3)};
  for (double& one : change.stiffness) one += 2.0;
  for (double& one : change.shrinkage) one += 0.03;
  const ChangedTissue changed = cube.finite.changed(change);
  const std::vector<RelaxationTerm> terms = {{0.8, 0.1}, {0.6, 1.9}};
  const std::vector<SteppedTerm> steps = stepped(terms, 1.0 / 60.0);
  TissueMemory memory;
  Overstress overstress;
  for (unsigned step = 0; step < 6; ++step)
    overstress = cube.finite.relax(random_vector(n, 0.04, 20 + step), changed, steps, memory);
  ASSERT_TRUE(cube.finite.fits(memory, terms.size()));
  const std::vector<double> u = random_vector(n, 0.04, 12), way = random_vector(n, 1.0, 14);
  FiniteBody::Workspace workspace;
  std::vector<double> g(n, 0.0);
  cube.finite.energy(u, g, workspace, {}, changed, overstress);
  const double step = 1e-6;
  const auto energy = [&](double to) {
    return cube.finite.energy(on_the_way(u, way, to), {}, workspace, {}, changed, overstress);
  };
  EXPECT_NEAR((energy(step) - energy(-step)) / (2.0 * step), work(g, way),
              1e-7 * norm(g) * norm(way));
}

TEST_P(FiniteFibres, RelaxAsTheTissueAboutThemWhereStrainsAreSmall) {
  const Cube cube = Cube::make(GetParam(), true, {}, winding);
  const std::vector<double> shape = random_vector(3 * cube.finite.nodes(), 1e-8, 1);
  const std::vector<double> elastic = cube.gradient(shape);
  const std::vector<RelaxationTerm> terms = {{0.8, 0.1}};
  const std::vector<SteppedTerm> steps = stepped(terms, 1.0 / 60.0);
  TissueMemory memory;
  const std::vector<double> rest(shape.size(), 0.0);
  FiniteBody::Workspace workspace;
  Overstress overstress = cube.finite.relax(rest, {}, steps, memory);
  double chains = 0.0;  // strain at which they hold without stress
  for (int step = 1; step <= 20; ++step) {
    std::vector<double> forces(shape.size(), 0.0), expected = elastic;
    cube.finite.energy(shape, forces, workspace, {}, {}, overstress);
    for (double& force : expected) force *= 1.0 + steps[0].over * (1.0 - chains);
    EXPECT_LT(distance(forces, expected), 1e-6 * norm(elastic)) << step;
    overstress = cube.finite.relax(shape, {}, steps, memory);
    chains += (1.0 - steps[0].kept) * (1.0 - chains);
  }
}

/// Stress of the law along the axes of a bar with these stretches, whose fibres lie along `axis`.
Vec3 nominal_stress(const Vec3& stretches, double poisson_ratio, int axis) {
  const IsotropicMaterial tissue{kYoungs, poisson_ratio};
  const double mu = tissue.shear_modulus(), lambda = tissue.lame_lambda();
  const double volume = stretches.prod(), s = stretches[axis] * stretches[axis] - 1.0;
  Vec3 stress =
      mu * stretches + ((lambda + mu) * (volume - 1.0) - mu) * volume * stretches.cwiseInverse();
  const double b = mu / kFibres;  // twice kBuckling is one
  const double slope = 0.25 * kFibres * s / (s < 0.0 ? std::sqrt(1.0 + s * s / (b * b)) : 1.0);
  stress[axis] += 2.0 * slope * stretches[axis];
  return stress;
}

/// Stretches of a bar that is pulled along x by so much force over its first area.
Vec3 pulled(double force, double poisson_ratio, int axis) {
  Vec3 stretches = Vec3::Ones();
  for (int i = 0; i < 200; ++i) {
    const Vec3 wrong = nominal_stress(stretches, poisson_ratio, axis) - force * Vec3::UnitX();
    Mat3 change;
    for (int k = 0; k < 3; ++k)
      change.col(k) = (nominal_stress(stretches + 1e-7 * Vec3::Unit(k), poisson_ratio, axis) -
                       nominal_stress(stretches - 1e-7 * Vec3::Unit(k), poisson_ratio, axis)) /
                      2e-7;
    const Vec3 step = change.partialPivLu().solve(wrong);
    stretches -= std::min(1.0, 0.1 / step.norm()) * step;
  }
  return stretches;
}

/// The same of a cube between dead loads, by Newton's method.
Vec3 pulled_cube(double force, double poisson_ratio, int axis) {
  const Cube cube = Cube::make(poisson_ratio, false, {}, even(Vec3::Unit(axis)), 1);
  const std::vector<double> loads = cube.system.loads(
      {.body_force = {},
       .traction =
           [&](const Vec3&, const Vec3& normal) {
             return Vec3(std::abs(normal.x()) > 0.9 ? Vec3(force * normal.x() * Vec3::UnitX())
                                                    : Vec3::Zero());
           },
       .held_displacement = {}});
  std::vector<double> u(loads.size(), 0.0);
  const auto n = static_cast<Eigen::Index>(u.size());
  for (int i = 0; i < 40; ++i) {
    VectorX wrong = Eigen::Map<const VectorX>(loads.data(), n);
    const std::vector<double> g = cube.gradient(u);
    wrong -= Eigen::Map<const VectorX>(g.data(), n);
    const SymmetricBlockMatrix tangent = cube.finite.tangent(u);
    MatrixX dense(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      std::vector<double> unit(u.size(), 0.0), column(u.size());
      unit[static_cast<std::size_t>(k)] = 1.0;
      tangent.multiply(unit, column);
      dense.col(k) = Eigen::Map<const VectorX>(column.data(), n);
    }
    dense.diagonal().array() += 1.0;  // nothing holds it
    const VectorX step = dense.ldlt().solve(wrong);
    const double most = step.cwiseAbs().maxCoeff();
    Eigen::Map<VectorX>(u.data(), n) += std::min(1.0, 0.05 / most) * step;
    if (most < 1e-9) break;
  }
  Vec3 stretches = Vec3::Zero();
  const std::vector<Mat3> gradients = cube.finite.mean_gradients(u);
  for (const Mat3& f : gradients)
    stretches +=
        Vec3((f.transpose() * f).diagonal().cwiseSqrt()) / static_cast<double>(gradients.size());
  return stretches;
}

TEST_P(FiniteFibres, ABarIsPulledAndPressedAlongAndAcrossAsItsLawSays) {
  for (const int axis : {0, 1})
    for (const double force : {5e3, -1.5e3}) {
      const Vec3 exact = pulled(force, GetParam(), axis),
                 found = pulled_cube(force, GetParam(), axis);
      EXPECT_LT((found - exact).norm(), 1e-5)
          << axis << " " << force << ": " << found.transpose() << " | " << exact.transpose();
      EXPECT_GT(std::abs(exact.x() - 1.0), 0.02);
    }
}

INSTANTIATE_TEST_SUITE_P(PoissonsRatio, FiniteFibres, testing::Values(0.3, 0.45),
                         [](const auto& info) {
                           return "Of" + std::to_string(static_cast<int>(100 * info.param));
                         });

TEST(FiniteBodyWithFibres, HasTheSameBitsForAnyNumberOfThreads) {
  const Cube cube = Cube::make(0.45, true, stiffer_end, winding);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 8);
  const std::vector<double> many = cube.gradient(u);
  const double energy = cube.energy(u);
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(cube.gradient(u), many);
  EXPECT_EQ(cube.energy(u), energy);
}

TEST(FiniteBodyWithFibres, HasTheBitsOfABareOneWhereTheyHaveNoModulus) {
  const Cube cube = Cube::make(0.45, true, {}, even(Vec3::UnitX(), 0.0)), bare = Cube::make(0.45);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 8);
  EXPECT_EQ(cube.gradient(u), bare.gradient(u));
  EXPECT_EQ(cube.energy(u), bare.energy(u));
  EXPECT_EQ(cube.system.stiffness().blocks, bare.system.stiffness().blocks);
}

TEST(FiniteBodyWithFibres, TurnedInsideOutHasAFiniteEnergyThatFallsOnItsWayBack) {
  const Cube cube = Cube::make(0.45, false, {}, even(Vec3(0.2, 0.0, 1.0)));
  const auto mirrored = [&](double s) {
    return cube.moved([&](const Vec3& x) { return Vec3(x.x(), x.y(), s * x.z()); });
  };
  double before = cube.energy(mirrored(-0.9));
  EXPECT_TRUE(std::isfinite(before));
  for (const double s : {-0.6, -0.3, 0.0, 0.3, 0.6, 1.0}) {
    const double now = cube.energy(mirrored(s));
    EXPECT_LT(now, before) << s;
    before = now;
  }
}

TEST(FiniteBodyWithFibres, FibresThatCannotBeAreRefusedByPlaceAndLimit) {
  const auto refused = [](const Fibres& fibres) {
    const NodedBody body = jittered_cube(4, 0.2);
    ElasticProblem problem =
        body.problem({kYoungs, 0.45}, [](const Vec3& x) { return x.x() < -0.499; });
    problem.fibres = [&](const Vec3&, double) { return fibres; };
    const auto system = GalerkinSystem::assemble(problem, 1.8, Cube::no_progress());
    return system ? std::string() : system.error().text();
  };
  EXPECT_NE(refused({Vec3::Zero(), 1e3}).find("expected one of length 1"), std::string::npos);
  EXPECT_NE(refused({Vec3::UnitX(), 2e8}).find("expected 0 to 10,000 times"), std::string::npos);
  EXPECT_NE(refused({Vec3::UnitX(), -1.0}).find("a modulus of -1 Pa"), std::string::npos);
  EXPECT_NE(refused({Vec3::UnitX(), std::nan("")}).find("a modulus of nan"), std::string::npos);
  EXPECT_EQ(refused({Vec3::UnitX(), 0.0}), "");
}

}  // namespace
}  // namespace viscera
