#include "kernels/finite/finite_body.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <numeric>

#include "kernels/paff/nodal_measures.h"
#include "tests/kernels/finite/finite_cube.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

class FiniteBodyOf : public testing::TestWithParam<double> {};

TEST_P(FiniteBodyOf, SmallDisplacementsMeetTheForcesOfTheLinearBody) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 1e-9, 1);
  std::vector<double> linear(u.size());
  cube.system.stiffness().multiply(u, linear);
  EXPECT_LT(distance(cube.gradient(u), linear), 1e-7 * norm(linear));
}

TEST_P(FiniteBodyOf, TheTangentAtRestIsTheLinearStiffness) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> rest(3 * cube.finite.nodes(), 0.0);
  const SymmetricBlockMatrix tangent = cube.finite.tangent(rest);
  const std::vector<double> v = random_vector(rest.size(), 1.0, 2);
  std::vector<double> one(v.size()), other(v.size());
  tangent.multiply(v, one);
  cube.system.stiffness().multiply(v, other);
  EXPECT_LT(distance(one, other), kSingle * norm(other));
}

TEST_P(FiniteBodyOf, ATangentThatAveragesNothingIsAsStiffAgainstAnEvenChangeAndHalfAsWide) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> rest(3 * cube.finite.nodes(), 0.0);
  const SymmetricBlockMatrix exact = cube.finite.tangent(rest),
                             narrow = cube.finite.tangent(rest, {.pointwise = true});
  // What is averaged over a cell is a polynomial of the change of volume: an even one is its own.
  const std::vector<double> even = cube.moved(
      [](const Vec3& x) { return Vec3(1.1 * x.x(), 0.97 * x.y() + 0.2 * x.z(), x.z()); });
  std::vector<double> one(even.size()), other(even.size());
  exact.multiply(even, one);
  narrow.multiply(even, other);
  const double energy = std::inner_product(one.begin(), one.end(), even.begin(), 0.0);
  EXPECT_NEAR(std::inner_product(other.begin(), other.end(), even.begin(), 0.0), energy,
              1e-5 * energy);
  // Against others it is stiffer: projecting lets go of what a cell's polynomials don't have.
  const std::vector<double> rough = random_vector(rest.size(), 1.0, 2);
  exact.multiply(rough, one);
  narrow.multiply(rough, other);
  EXPECT_GE(std::inner_product(other.begin(), other.end(), rough.begin(), 0.0),
            std::inner_product(one.begin(), one.end(), rough.begin(), 0.0) * (1.0 - 1e-6));
  if (GetParam() > 0.4) {
    EXPECT_LT(static_cast<double>(narrow.pattern.columns.size()),
              0.8 * static_cast<double>(exact.pattern.columns.size()));
  }
}

/// Twenty times as stiff where x + y > 0.1, with a border as wide as the cubes that are asked for.
double stiffer_corner(const Vec3& x, double edge) {
  return 1.0 + 19.0 * std::clamp(0.5 + ((x.x() + x.y()) / std::sqrt(2.0) - 0.1) / edge, 0.0, 1.0);
}

TEST_P(FiniteBodyOf, WhereTheModulusChangesTheTangentAtRestIsTheLinearStiffness) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_corner);
  const std::vector<double> rest(3 * cube.finite.nodes(), 0.0);
  const std::vector<double> v = random_vector(rest.size(), 1.0, 2);
  std::vector<double> one(v.size()), other(v.size());
  cube.finite.tangent(rest).multiply(v, one);
  cube.system.stiffness().multiply(v, other);
  EXPECT_LT(distance(one, other), kSingle * norm(other));
  std::vector<double> uniform(v.size());
  Cube::make(GetParam()).system.stiffness().multiply(v, uniform);
  EXPECT_GT(distance(uniform, other), 0.5 * norm(other));
}

TEST_P(FiniteBodyOf, WhereTheModulusChangesVolumeIsStillVolume) {
  const Cube cube = Cube::make(GetParam(), true, stiffer_corner);
  EXPECT_NEAR(cube.finite.volume(), 1.0, 1e-12);
  const std::vector<double> grown = cube.moved([](const Vec3& x) { return Vec3(1.1 * x); });
  EXPECT_NEAR(cube.finite.volume(grown), 1.331, 1e-5);
}

TEST_P(FiniteBodyOf, ForcesAreTheDerivativeOfTheEnergy) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.04, 3);
  const std::vector<double> direction = random_vector(u.size(), 1.0, 4);
  const std::vector<double> g = cube.gradient(u);
  double exact = 0.0;
  for (std::size_t i = 0; i < u.size(); ++i) exact += g[i] * direction[i];
  const double step = 1e-6;
  std::vector<double> ahead = u, behind = u;
  for (std::size_t i = 0; i < u.size(); ++i) {
    ahead[i] += step * direction[i];
    behind[i] -= step * direction[i];
  }
  const double difference = (cube.energy(ahead) - cube.energy(behind)) / (2.0 * step);
  EXPECT_NEAR(difference, exact, 1e-7 * norm(g) * norm(direction));
}

TEST_P(FiniteBodyOf, TheTangentIsTheDerivativeOfTheForces) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.04, 5);
  const std::vector<double> direction = random_vector(u.size(), 1.0, 6);
  std::vector<double> exact(u.size());
  cube.finite.tangent(u).multiply(direction, exact);
  const double step = 1e-6;
  std::vector<double> ahead = u, behind = u;
  for (std::size_t i = 0; i < u.size(); ++i) {
    ahead[i] += step * direction[i];
    behind[i] -= step * direction[i];
  }
  std::vector<double> difference = cube.gradient(ahead);
  const std::vector<double> before = cube.gradient(behind);
  for (std::size_t i = 0; i < u.size(); ++i)
    difference[i] = (difference[i] - before[i]) / (2.0 * step);
  EXPECT_LT(distance(difference, exact), 1e-7 * norm(exact));
}

TEST_P(FiniteBodyOf, AnEvenStretchHasTheEnergyOfItsLaw) {
  const Cube cube = Cube::make(GetParam(), false);
  Mat3 f;
  f << 1.3, 0.2, 0.0, -0.1, 0.8, 0.1, 0.0, 0.3, 1.1;
  const std::vector<double> u = cube.moved([&](const Vec3& x) { return Vec3(f * x); });
  const double mu = 10e3 / (2.0 * (1.0 + GetParam())),
               lambda = 2.0 * mu * GetParam() / (1.0 - 2.0 * GetParam());
  const double grown = f.determinant() - 1.0;
  const double law =
      0.5 * mu * (f.squaredNorm() - 3.0) - mu * grown + 0.5 * (lambda + mu) * grown * grown;
  EXPECT_NEAR(cube.finite.volume(), 1.0, 1e-12);
  EXPECT_NEAR(cube.energy(u), law, kSingle * law);
  EXPECT_NEAR(cube.finite.volume(u), f.determinant(), kSingle);
}

TEST_P(FiniteBodyOf, TurningABodyTurnsItsForcesAndKeepsItsEnergy) {
  const Cube cube = Cube::make(GetParam(), false);
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

TEST_P(FiniteBodyOf, TissueThatIsStifferAllOverHasItsEnergyAsManyTimes) {
  const Cube cube = Cube::make(GetParam(), false);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 11);
  const ChangedTissue changed = cube.finite.changed(
      {.stiffness = std::vector<double>(cube.finite.points(), 3.0), .shrinkage = {}});
  FiniteBody::Workspace workspace;
  std::vector<double> forces(u.size(), 0.0), sound = cube.gradient(u);
  const double energy = cube.finite.energy(u, forces, workspace, {}, changed);
  EXPECT_NEAR(energy, 3.0 * cube.energy(u), 1e-12 * energy);
  for (double& force : sound) force *= 3.0;
  EXPECT_LT(distance(forces, sound), 1e-12 * norm(sound));
}

TEST_P(FiniteBodyOf, TissueThatHasShrunkAllOverRestsWhereItIsAsMuchSmaller) {
  const Cube cube = Cube::make(GetParam(), false);
  constexpr double kShrunk = 0.2;
  const ChangedTissue changed = cube.finite.changed(
      {.stiffness = {}, .shrinkage = std::vector<double>(cube.finite.points(), kShrunk)});
  const std::vector<double> u = cube.moved([](const Vec3& x) { return Vec3((1 - kShrunk) * x); });
  const std::vector<double> rest(u.size(), 0.0);
  FiniteBody::Workspace workspace;
  std::vector<double> there(u.size(), 0.0), before = there;
  const double energy = cube.finite.energy(rest, before, workspace, {}, changed);
  EXPECT_GT(energy, 10.0);
  EXPECT_LT(std::abs(cube.finite.energy(u, there, workspace, {}, changed)), kSingle * energy);
  EXPECT_LT(norm(there), kSingle * norm(before));
}

TEST_P(FiniteBodyOf, TissueThatSwellsRestsWhereItIsAsMuchGreaterAlsoWhereItHasShrunk) {
  const Cube cube = Cube::make(GetParam(), false);
  constexpr double kSwollen = 0.15, kShrunk = 0.1, kSize = (1.0 + kSwollen) * (1.0 - kShrunk);
  const ChangedTissue changed = cube.finite.changed(
      {.stiffness = {}, .shrinkage = std::vector<double>(cube.finite.points(), kShrunk)}, kSwollen);
  const std::vector<double> u = cube.moved([=](const Vec3& x) { return Vec3(kSize * x); });
  const std::vector<double> rest(u.size(), 0.0);
  FiniteBody::Workspace workspace;
  std::vector<double> there(u.size(), 0.0), before = there;
  const double energy = cube.finite.energy(rest, before, workspace, {}, changed);
  EXPECT_GT(energy, 1.0);
  EXPECT_LT(std::abs(cube.finite.energy(u, there, workspace, {}, changed)), kSingle * energy);
  EXPECT_LT(norm(there), 10.0 * kSingle * norm(before));
}

/// Some of it, here and there, within cells.
TissueChange a_change(std::size_t points, double shrinkage) {
  TissueChange change;
  for (std::size_t q = 0; q < points; ++q) {
    change.stiffness.push_back(1.0 + static_cast<double>(q % 5));
    change.shrinkage.push_back(shrinkage * static_cast<double>(q % 7));
  }
  return change;
}

TEST_P(FiniteBodyOf, ChangedTissueOfSmallStrainsIsThatOfTheLinearBody) {
  const Cube cube = Cube::make(GetParam());
  const auto region = cube.system.region([](const Vec3&) { return true; });
  ASSERT_TRUE(region);
  const double scale = 1e-7;
  const TissueChange change = a_change(cube.finite.points(), scale);
  SymmetricBlockMatrix stiffness = cube.system.stiffness();
  add_stiffness(*region, change.stiffness, stiffness);
  std::vector<double> strains;
  for (const double shrinkage : change.shrinkage) strains.push_back(-shrinkage);
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

TEST_P(FiniteBodyOf, ForcesOfChangedAndViscousTissueAreTheDerivativeOfItsEnergy) {
  const Cube cube = Cube::make(GetParam());
  const ChangedTissue changed = cube.finite.changed(a_change(cube.finite.points(), 0.03));
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.04, 12);
  const Strains before = cube.finite.strains(random_vector(u.size(), 0.02, 13));
  const Viscosity viscosity{1.2, before};
  const std::vector<double> direction = random_vector(u.size(), 1.0, 14);
  FiniteBody::Workspace workspace;
  std::vector<double> g(u.size(), 0.0), ahead = u, behind = u;
  cube.finite.energy(u, g, workspace, viscosity, changed);
  double exact = 0.0;
  const double step = 1e-6;
  for (std::size_t i = 0; i < u.size(); ++i) {
    exact += g[i] * direction[i];
    ahead[i] += step * direction[i];
    behind[i] -= step * direction[i];
  }
  const double difference = (cube.finite.energy(ahead, {}, workspace, viscosity, changed) -
                             cube.finite.energy(behind, {}, workspace, viscosity, changed)) /
                            (2.0 * step);
  EXPECT_NEAR(difference, exact, 1e-7 * norm(g) * norm(direction));
}

TEST(FiniteBody, WhatIsNoChangeOfTissueCountsAsNone) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 15);
  const ChangedTissue changed = cube.finite.changed(
      {.stiffness = {0.5, std::nan(""), 1.0}, .shrinkage = {-0.1, std::nan("")}});
  FiniteBody::Workspace workspace;
  EXPECT_NEAR(cube.finite.energy(u, {}, workspace, {}, changed), cube.energy(u),
              1e-12 * cube.energy(u));
}

INSTANTIATE_TEST_SUITE_P(PoissonsRatio, FiniteBodyOf, testing::Values(0.3, 0.45, 0.49),
                         [](const auto& info) {
                           return "Of" + std::to_string(static_cast<int>(100 * info.param));
                         });

TEST(FiniteBody, MeanGradientsOfARotationAreThatRotation) {
  const Cube cube = Cube::make(0.45);
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3::UnitZ()).toRotationMatrix();
  const auto u = cube.moved([&](const Vec3& x) { return Vec3(turn * x); });
  for (const Mat3& f : cube.finite.mean_gradients(u)) EXPECT_LT((f - turn).norm(), 1e-11);
}

TEST(FiniteBody, EnergyAndForcesHaveTheSameBitsForAnyNumberOfThreads) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 8);
  const std::vector<double> many = cube.gradient(u);
  const double energy = cube.energy(u);
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(cube.gradient(u), many);
  EXPECT_EQ(cube.energy(u), energy);
}

TEST(FiniteBody, TissueTurnedInsideOutHasAFiniteEnergyThatFallsOnItsWayBack) {
  const Cube cube = Cube::make(0.45, false);
  const auto mirrored = [&](double s) {
    return cube.moved([&](const Vec3& x) { return Vec3(x.x(), x.y(), s * x.z()); });
  };
  double before = cube.energy(mirrored(-1.0));
  EXPECT_TRUE(std::isfinite(before));
  for (const double s : {-0.6, -0.3, 0.0, 0.3, 0.6, 1.0}) {
    const double now = cube.energy(mirrored(s));
    EXPECT_LT(now, before) << s;
    before = now;
  }
}

/// Two leaves on a common root, so close that each has nodes whose fields would reach the other.
TEST(FiniteBodyOfLeaves, HasItsLinearStiffnessAtRestAndVolumesOfAllItsNodes) {
  const double spacing = 2e-3;
  const test::Body body =
      test::placed_body(test::leaves({20e-3, 8e-3, 4e-3}, 0.6e-3, 4e-3, spacing),
                        [&](const Vec3&) { return spacing; });
  const auto system = GalerkinSystem::assemble(
      body.problem({10e3, 0.45}, [](const Vec3& x) { return x.x() < 1e-9; }), 1.8,
      Cube::no_progress());
  ASSERT_TRUE(system) << system.error().text();
  ASSERT_GT(system->figures().twins, 0u);
  const auto region = system->region([](const Vec3&) { return true; });
  const auto hold = system->hold();
  const auto finite = FiniteBody::create(*region, *hold);
  ASSERT_TRUE(finite) << finite.error().text();
  ASSERT_EQ(finite->nodes(), body.cloud.size() + system->figures().twins);
  const std::vector<double> rest(3 * finite->nodes(), 0.0);
  const SymmetricBlockMatrix tangent = finite->tangent(rest);
  std::vector<double> v(rest.size()), one(rest.size()), other(rest.size());
  std::mt19937 random(3);
  for (double& value : v) value = std::uniform_real_distribution(-1.0, 1.0)(random);
  tangent.multiply(v, one);
  system->stiffness().multiply(v, other);
  double off = 0.0, size = 0.0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    off += (one[i] - other[i]) * (one[i] - other[i]);
    size += other[i] * other[i];
  }
  EXPECT_LT(std::sqrt(off / size), 4.0 * kSingle);

  const auto volumes = nodal_volumes(body.surface, body.cloud, system->fields());
  ASSERT_TRUE(volumes) << volumes.error().text();
  ASSERT_EQ(volumes->size(), finite->nodes());
  const double sum = std::accumulate(volumes->begin(), volumes->end(), 0.0);
  EXPECT_NEAR(sum, volume(body.surface), 1e-10 * sum);
}

}  // namespace
}  // namespace viscera
