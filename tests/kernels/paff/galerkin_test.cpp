#include "kernels/paff/galerkin.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <numeric>

#include "kernels/points/node_placement.h"
#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

constexpr IsotropicMaterial kLiver{10e3, 0.45};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool on_floor(const Vec3& x) {
  return x.z() < -0.5 + 1e-9;
}

MatrixX dense(const SymmetricBlockMatrix& matrix) {
  const auto w = static_cast<Eigen::Index>(matrix.width);
  const auto n = w * static_cast<Eigen::Index>(matrix.pattern.rows());
  MatrixX full = MatrixX::Zero(n, n);
  for (std::size_t row = 0; row < matrix.pattern.rows(); ++row) {
    for (std::size_t e = matrix.pattern.row_begin[row]; e < matrix.pattern.row_begin[row + 1];
         ++e) {
      const auto i = w * static_cast<Eigen::Index>(row);
      const auto j = w * static_cast<Eigen::Index>(matrix.pattern.columns[e]);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> block(
          matrix.blocks.data() + 9 * e);
      full.block(i, j, w, w) = block;
      full.block(j, i, w, w) = block.transpose();
    }
  }
  return full;
}

std::vector<int> nodes_where(const PointCloud& cloud, const std::function<bool(const Vec3&)>& is) {
  std::vector<int> nodes;
  for (std::size_t i = 0; i < cloud.surface_count; ++i) {
    if (is(cloud.positions[i])) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

class GalerkinCube : public testing::Test {
 protected:
  test::Body body = test::jittered_cube(5, 0.3);

  std::string error_of(const ElasticProblem& problem) const {
    const auto solver = galerkin_formulation().prepare(problem, no_progress());
    return solver ? "" : solver.error().text();
  }
};

class GalerkinCubeOfAnyMaterial : public GalerkinCube,
                                  public testing::WithParamInterface<double> {};

TEST_P(GalerkinCubeOfAnyMaterial, StiffnessIsPositiveDefinite) {
  const IsotropicMaterial material{10e3, GetParam()};
  const auto system =
      GalerkinSystem::assemble(body.problem(material, on_floor), 1.8, no_progress());
  ASSERT_TRUE(system) << system.error().text();
  const MatrixX stiffness = dense(system->stiffness());
  EXPECT_EQ((stiffness - stiffness.transpose()).cwiseAbs().maxCoeff(), 0.0);
  const VectorX values = Eigen::SelfAdjointEigenSolver<MatrixX>(stiffness).eigenvalues();
  // Stiff volumes don't soften the softest shears.
  EXPECT_GT(values.minCoeff(), 2e-5 * material.shear_modulus());
  EXPECT_GT(system->figures().gradient_correction, 0.0);
  EXPECT_LT(system->figures().gradient_correction, 0.1);
  EXPECT_NEAR(system->figures().fixed_area, 1.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(PoissonsRatio, GalerkinCubeOfAnyMaterial,
                         testing::Values(0.0, 0.3, 0.45, 0.499));

TEST_P(GalerkinCubeOfAnyMaterial, SoManyTimesTheModulusEverywhereIsSoManyTimesTheStiffness) {
  const test::Body body = jittered_cube(4, 0.2);
  const auto held = [](const Vec3& x) { return x.x() < -0.499; };
  ElasticProblem problem = body.problem({10e3, GetParam()}, held);
  problem.relative_modulus = [](const Vec3&, double) { return 10.0; };
  const auto scaled = GalerkinSystem::assemble(problem, 1.8, no_progress());
  const IsotropicMaterial stiff{100e3, GetParam()};
  const auto whole = GalerkinSystem::assemble(body.problem(stiff, held), 1.8, no_progress());
  ASSERT_TRUE(scaled && whole);
  const auto &one = scaled->stiffness().blocks, &other = whole->stiffness().blocks;
  ASSERT_EQ(one.size(), other.size());
  const double size = *std::max_element(other.begin(), other.end());
  for (std::size_t i = 0; i < one.size(); ++i) ASSERT_NEAR(one[i], other[i], 1e-12 * size);
}

/// Borders between tissue and a thousand times stiffer one, across the hold and along it.
TEST_P(GalerkinCubeOfAnyMaterial, StaysPositiveWhereTheModulusJumpsAThousandfold) {
  const test::Body body = jittered_cube(4, 0.2);
  const Random random(5, 0);
  for (std::uint64_t plane = 0; plane < 24; ++plane) {
    const Vec3 normal = Vec3(random.uniform(4 * plane) - 0.5, random.uniform(4 * plane + 1) - 0.5,
                             random.uniform(4 * plane + 2) - 0.5)
                            .normalized();
    const double at = 0.7 * (random.uniform(4 * plane + 3) - 0.5);
    ElasticProblem problem =
        body.problem({10e3, GetParam()}, [](const Vec3& x) { return x.x() < -0.499; });
    problem.relative_modulus = [&](const Vec3& x, double) {
      return x.dot(normal) > at ? 1000.0 : 1.0;
    };
    const auto system = GalerkinSystem::assemble(problem, 1.8, no_progress());
    ASSERT_TRUE(system) << system.error().text();
    EXPECT_TRUE(system->factor()) << "plane " << plane;
  }
}

TEST_P(GalerkinCubeOfAnyMaterial, RefusesModuliThatAreNone) {
  const test::Body body = jittered_cube(4, 0.2);
  ElasticProblem problem =
      body.problem({10e3, GetParam()}, [](const Vec3& x) { return x.x() < -0.499; });
  for (const double wrong : {0.0, -1.0, 1e6, std::numeric_limits<double>::quiet_NaN()}) {
    problem.relative_modulus = [=](const Vec3& x, double) { return x.z() > 0.3 ? wrong : 1.0; };
    const auto system = GalerkinSystem::assemble(problem, 1.8, no_progress());
    ASSERT_FALSE(system) << wrong;
    EXPECT_NE(system.error().text().find("times that of the tissue; expected 0.0001 to 10,000"),
              std::string::npos);
  }
}

TEST_F(GalerkinCube, RigidMotionOfTheHeldPartCausesNoStress) {
  const auto system = GalerkinSystem::assemble(body.problem(kLiver, on_floor), 1.8, no_progress());
  ASSERT_TRUE(system) << system.error().text();
  const auto rigid = [](const Vec3& x) {
    return Vec3(Vec3(0.1, -0.2, 0.3) + Vec3(0.5, 0.1, -0.4).cross(x));
  };
  const auto unknowns =
      system->solve({.body_force = {}, .traction = {}, .held_displacement = rigid});
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  EXPECT_LT(test::largest_error(*system, *unknowns, rigid), 1e-11);
}

TEST_F(GalerkinCube, ComplianceIsSymmetricAndPositive) {
  const auto solver = galerkin_formulation().prepare(body.problem(kLiver, on_floor), no_progress());
  ASSERT_TRUE(solver) << solver.error().text();
  const std::vector<int> all = test::first_indices(body.cloud.size());
  const std::vector<int> touchable =
      nodes_where(body.cloud, [](const Vec3& x) { return x.z() > 0.49; });
  const auto compliance =
      (*solver)->compliance(test::nodes_as_places(all), touchable, no_progress());
  ASSERT_TRUE(compliance) << compliance.error().text();
  ASSERT_EQ(compliance->columns.size(), 9 * all.size() * touchable.size());

  const auto order = static_cast<Eigen::Index>(3 * touchable.size());
  MatrixX square(order, order);
  for (Eigen::Index j = 0; j < order; ++j) {
    for (Eigen::Index i = 0; i < order; ++i) {
      const auto row =
          static_cast<std::size_t>(3 * touchable[static_cast<std::size_t>(i / 3)] + i % 3);
      square(i, j) = compliance->columns[static_cast<std::size_t>(j) * compliance->rows() + row];
    }
  }
  EXPECT_EQ((square - square.transpose()).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(square).eigenvalues().minCoeff(), 0.0);

  // A column is the answer of the solver to one unit load, but for the single precision of its
  // factor.
  std::vector<double> load(3 * body.cloud.size(), 0.0);
  load[static_cast<std::size_t>(3 * touchable[4] + 2)] = 1.0;
  ASSERT_TRUE((*solver)->solve(load, 1));
  for (std::size_t i = 0; i < load.size(); ++i) {
    const double stored = compliance->columns[(3 * 4 + 2) * compliance->rows() + i];
    EXPECT_NEAR(stored, load[i],
                1e-5 * std::abs(load[static_cast<std::size_t>(3 * touchable[4] + 2)]));
  }
}

TEST_F(GalerkinCube, ResultsDontDependOnTheNumberOfThreads) {
  const auto columns = [&](std::size_t threads) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    const auto solver =
        galerkin_formulation().prepare(body.problem(kLiver, on_floor), no_progress());
    const std::vector<int> top =
        nodes_where(body.cloud, [](const Vec3& x) { return x.z() > 0.49; });
    return (*solver)
        ->compliance(test::nodes_as_places(top), test::first_indices(top.size()), no_progress())
        ->columns;
  };
  EXPECT_EQ(columns(1), columns(2));
}

TEST_F(GalerkinCube, IsFoundByName) {
  EXPECT_EQ(find_formulation("galerkin"), &galerkin_formulation());
  EXPECT_EQ(find_formulation("no such thing"), nullptr);
  const std::vector<std::string> names = formulation_names();
  EXPECT_EQ(std::count(names.begin(), names.end(), "galerkin"), 1);
}

TEST_F(GalerkinCube, RefusesAFixedRegionThatHoldsNothing) {
  const std::string error =
      error_of(body.problem(kLiver, [](const Vec3& x) { return x.z() < -2.0; }));
  EXPECT_NE(error.find("fixed region"), std::string::npos) << error;
  EXPECT_NE(error_of(body.problem(kLiver, {})).find("fixed region"), std::string::npos);
}

TEST_F(GalerkinCube, RefusesImpossibleMaterials) {
  for (const double poisson : {0.5, 0.7, -0.1, kNaN}) {
    const std::string error = error_of(body.problem({10e3, poisson}, on_floor));
    EXPECT_NE(error.find("Poisson's ratio"), std::string::npos) << poisson;
  }
  for (const double youngs : {0.0, -1.0, kNaN, std::numeric_limits<double>::infinity()}) {
    const std::string error = error_of(body.problem({youngs, 0.3}, on_floor));
    EXPECT_NE(error.find("Young's modulus"), std::string::npos) << youngs;
  }
}

TEST_F(GalerkinCube, ListsAllMistakesAtOnce) {
  const auto solver = galerkin_formulation().prepare(body.problem({-1.0, 0.5}, {}), no_progress());
  ASSERT_FALSE(solver);
  EXPECT_EQ(solver.error().messages.size(), 3u);
}

TEST_F(GalerkinCube, RefusesNumbersThatAreNotFinite) {
  test::Body broken = body;
  broken.cloud.positions[17].y() = kNaN;
  EXPECT_NE(error_of(broken.problem(kLiver, on_floor)).find("node 17"), std::string::npos);
  broken = body;
  broken.cloud.spacings[3] = 0.0;
  EXPECT_NE(error_of(broken.problem(kLiver, on_floor)).find("node 3"), std::string::npos);
  broken = body;
  broken.surface.vertices[2].x() = kNaN;
  EXPECT_NE(error_of(broken.problem(kLiver, on_floor)).find("vertex 2"), std::string::npos);
}

TEST_F(GalerkinCube, RefusesTooFewNodes) {
  test::Body sparse = body;
  sparse.cloud.positions.resize(3);
  sparse.cloud.spacings.resize(3);
  EXPECT_NE(error_of(sparse.problem(kLiver, on_floor)).find("nodes: there are 3"),
            std::string::npos);

  sparse.cloud.positions = {Vec3(.1, 0, 0), Vec3(0, .1, 0), Vec3(0, 0, .1), Vec3(0, 0, 0)};
  sparse.cloud.spacings.assign(4, 0.35);
  const std::string error = error_of(sparse.problem(kLiver, on_floor));
  EXPECT_NE(error.find("smaller node spacing"), std::string::npos) << error;
}

TEST_F(GalerkinCube, RefusesNodesThatCoincideAlmost) {
  for (const double apart : {0.0, 1e-9, 1e-3}) {
    test::Body twice = body;
    twice.cloud.positions[40] = body.cloud.positions[12] + Vec3(apart, 0, 0);
    twice.cloud.spacings = measure_spacings(twice.cloud.positions);
    const std::string error = error_of(twice.problem(kLiver, on_floor));
    EXPECT_NE(error.find("12 and 40"), std::string::npos) << error;
    EXPECT_NE(error.find("remove one"), std::string::npos) << error;
  }
}

TEST_F(GalerkinCube, RefusesACrowdOfNodes) {
  test::Body crowded = body;
  for (int i = 0; i < 8; ++i) {
    crowded.cloud.positions.push_back(1e-3 * Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1));
  }
  crowded.cloud.spacings = measure_spacings(crowded.cloud.positions);
  const std::string error = error_of(crowded.problem(kLiver, on_floor));
  EXPECT_NE(error.find("gradually"), std::string::npos) << error;
}

TEST_F(GalerkinCube, RefusesSpacingsInAWrongUnit) {
  test::Body broken = body;
  for (double& spacing : broken.cloud.spacings) spacing *= 1e-3;
  EXPECT_NE(error_of(broken.problem(kLiver, on_floor)).find("spacings"), std::string::npos);
}

TEST_F(GalerkinCube, RefusesWrongListsOfPlaces) {
  const auto solver = galerkin_formulation().prepare(body.problem(kLiver, on_floor), no_progress());
  ASSERT_TRUE(solver);
  const auto refuses = [&](const std::vector<int>& nodes, std::vector<int> touchable) {
    const SparseWeights places = test::nodes_as_places(nodes);
    return !(*solver)->compliance(places, std::move(touchable), no_progress());
  };
  EXPECT_TRUE(refuses({1, 2, 3}, {3}));
  EXPECT_TRUE(refuses({1, 2, 3}, {1, 0}));
  EXPECT_TRUE(refuses({1, 2, 100000}, {2}));
  EXPECT_TRUE(refuses({-1, 2}, {1}));
  EXPECT_FALSE(refuses({3, 2}, {1}));
  EXPECT_FALSE(refuses({1, 2}, {}));
}

TEST_F(GalerkinCube, StopsWhereverItIsCancelled) {
  int calls = 0;
  double last = 0.0;
  const auto count = [&](double fraction, std::string_view) {
    EXPECT_GE(fraction, last);
    last = fraction;
    ++calls;
    return true;
  };
  const auto solver = galerkin_formulation().prepare(body.problem(kLiver, on_floor), count);
  ASSERT_TRUE(solver);
  EXPECT_EQ(last, 1.0);
  for (int stop = 1; stop <= calls; ++stop) {
    int left = stop;
    const auto stopped = galerkin_formulation().prepare(
        body.problem(kLiver, on_floor), [&](double, std::string_view) { return --left > 0; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().text(), kCancelled);
  }
  const auto compliance = (*solver)->compliance(test::nodes_as_places({0, 1, 2}), {1},
                                                [](double, std::string_view) { return false; });
  ASSERT_FALSE(compliance);
  EXPECT_EQ(compliance.error().text(), kCancelled);
}

}  // namespace
}  // namespace viscera
