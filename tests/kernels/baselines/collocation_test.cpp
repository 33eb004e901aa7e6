#include "kernels/baselines/strong_forms/collocation.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

constexpr IsotropicMaterial kSoft{10e3, 0.3};

bool on_floor(const Vec3& x) {
  return x.z() < -0.5 + 1e-9;
}

bool in_lower_part(const Vec3& x) {
  return x.z() < -0.02;
}

test::Body small_ball() {
  return test::placed_body(test::icosphere(0.05, 3), [](const Vec3&) { return 0.012; });
}

std::vector<int> upper_surface(const test::Body& body) {
  std::vector<int> nodes;
  for (std::size_t i = 0; i < body.cloud.surface_count; ++i) {
    if (body.cloud.positions[i].z() > 0.0) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

/// Largest distance of nodal unknowns from a field, relative to the field.
double largest_nodal_error(const Result<std::vector<double>>& unknowns, const PointCloud& cloud,
                           const std::function<Vec3(const Vec3&)>& exact) {
  if (!unknowns) return std::numeric_limits<double>::infinity();
  double error = 0.0, size = 0.0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3 wanted = exact(cloud.positions[i]);
    error = std::max(error, (Vec3::Map(unknowns->data() + 3 * i) - wanted).norm());
    size = std::max(size, wanted.norm());
  }
  return error / size;
}

/// u_a = x^T Q_a x / 2 with the loads that hold it.
struct QuadraticField {
  std::array<Mat3, 3> second = {(Mat3() << .4, .1, -.2, .1, -.3, .2, -.2, .2, .5).finished(),
                                (Mat3() << -.2, .3, .1, .3, .2, -.1, .1, -.1, .3).finished(),
                                (Mat3() << .1, -.1, .2, -.1, .4, .3, .2, .3, -.6).finished()};

  Vec3 operator()(const Vec3& x) const {
    Vec3 u;
    for (int a = 0; a < 3; ++a) u[a] = 0.5 * x.dot(second[a] * x);
    return u;
  }

  StaticLoads loads(const IsotropicMaterial& material) const {
    const QuadraticField self = *this;
    StaticLoads loads;
    loads.held_displacement = self;
    loads.traction = [self, material](const Vec3& x, const Vec3& n) {
      Mat3 gradient;
      for (int a = 0; a < 3; ++a) gradient.row(a) = (self.second[a] * x).transpose();
      return Vec3(test::stress(material, gradient) * n);
    };
    loads.body_force = [self, material](const Vec3&) {
      const double lambda = material.lame_lambda(), mu = material.shear_modulus();
      Vec3 force;
      for (int a = 0; a < 3; ++a) {
        double divergence_slope = 0.0;
        for (int b = 0; b < 3; ++b) divergence_slope += self.second[b](b, a);
        force[a] = -(lambda + mu) * divergence_slope - mu * self.second[a].trace();
      }
      return force;
    };
    return loads;
  }
};

class StrongForm : public testing::TestWithParam<const char*> {
 protected:
  const Formulation& formulation = *find_formulation(GetParam());

  std::string error_of(const ElasticProblem& problem) const {
    const auto solver = formulation.prepare(problem, no_progress());
    return solver ? "" : solver.error().text();
  }
};

INSTANTIATE_TEST_SUITE_P(Names, StrongForm, testing::Values("paper", "gfdm"),
                         [](const auto& name) { return std::string(name.param); });

TEST_P(StrongForm, LinearFieldIsExactOnAJitteredCube) {
  const test::Body body = test::jittered_cube(7, 0.3);
  const test::LinearField field;
  for (const double poisson_ratio : {0.0, 0.45}) {
    const IsotropicMaterial material{10e3, poisson_ratio};
    const auto held_below =
        solve_static(formulation, body.problem(material, on_floor), field.loads(material));
    EXPECT_LT(largest_nodal_error(held_below, body.cloud, field), 1e-11);
    const auto held =
        solve_static(formulation, body.problem(material, [](const Vec3&) { return true; }),
                     field.loads(material));
    EXPECT_LT(largest_nodal_error(held, body.cloud, field), 1e-12);
  }
}

TEST_P(StrongForm, LinearFieldIsExactOnABall) {
  const test::Body body = small_ball();
  test::LinearField field;
  field.offset *= 0.05;
  const auto unknowns =
      solve_static(formulation, body.problem(kSoft, in_lower_part), field.loads(kSoft));
  EXPECT_LT(largest_nodal_error(unknowns, body.cloud, field), 1e-11);
}

TEST_P(StrongForm, ComplianceColumnsAreAnswersToUnitForcesAndStayUnsymmetric) {
  const test::Body body = small_ball();
  const auto solver = formulation.prepare(body.problem(kSoft, in_lower_part), no_progress());
  ASSERT_TRUE(solver) << solver.error().text();
  const std::vector<int> top = upper_surface(body);
  const auto compliance = (*solver)->compliance(test::nodes_as_places(top),
                                                test::first_indices(top.size()), no_progress());
  ASSERT_TRUE(compliance) << compliance.error().text();
  EXPECT_FALSE(compliance->symmetric);

  const std::size_t n = 3 * top.size();
  const Eigen::Map<const Eigen::MatrixXf> square(
      compliance->columns.data(), static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  EXPECT_GT((square - square.transpose()).norm(), 0.01f * square.norm());
  for (const std::size_t column : {std::size_t{5}, n / 2, n - 1}) {
    std::vector<double> load(3 * body.cloud.size(), 0.0);
    load[static_cast<std::size_t>(3 * top[column / 3]) + column % 3] = 1.0;
    ASSERT_TRUE((*solver)->solve(load, 1));
    for (std::size_t row = 0; row < n; ++row) {
      const double answer = load[static_cast<std::size_t>(3 * top[row / 3]) + row % 3];
      EXPECT_EQ(compliance->columns[column * n + row], static_cast<float>(answer));
    }
  }
}

TEST_P(StrongForm, ForcesOnHeldNodesDoNothing) {
  const test::Body body = test::jittered_cube(5, 0.1);
  const auto solver = formulation.prepare(body.problem(kSoft, on_floor), no_progress());
  ASSERT_TRUE(solver) << solver.error().text();
  std::vector<double> load(3 * body.cloud.size(), 0.0);
  for (std::size_t i = 0; i < body.cloud.surface_count; ++i) {
    if (on_floor(body.cloud.positions[i])) load[3 * i] = 1.0;
  }
  ASSERT_TRUE((*solver)->solve(load, 1));
  for (const double u : load) EXPECT_EQ(u, 0.0);
}

TEST_P(StrongForm, RefusesAFixedRegionThatTouchesNoNode) {
  const test::Body body = test::jittered_cube(5, 0.1);
  for (const double height : {-0.49, -2.0}) {
    // Between the floor's nodes and the next there is surface, but no node.
    const std::string error = error_of(
        body.problem(kSoft, [height](const Vec3& x) { return x.z() < height && x.z() > -0.499; }));
    EXPECT_NE(error.find("fixed region"), std::string::npos) << error;
    EXPECT_NE(error.find("larger"), std::string::npos) << error;
  }
}

TEST_P(StrongForm, RefusesBrokenClouds) {
  test::Body broken = test::jittered_cube(5, 0.1);
  broken.cloud.positions[17].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of(broken.problem(kSoft, on_floor)).find("node 17"), std::string::npos);
  broken = test::jittered_cube(5, 0.1);
  const std::size_t last = broken.cloud.surface_count - 1;  // on top, free
  broken.cloud.positions[last] = broken.cloud.positions[last - 1];
  EXPECT_NE(error_of(broken.problem(kSoft, on_floor)), "");
  broken.cloud.spacings.clear();
  EXPECT_NE(error_of(broken.problem(kSoft, on_floor)).find("spacings"), std::string::npos);
}

TEST_P(StrongForm, StopsWhereverItIsCancelled) {
  const test::Body body = test::jittered_cube(5, 0.1);
  for (int stop = 1; stop <= 4; ++stop) {
    int left = stop;
    const auto stopped = formulation.prepare(body.problem(kSoft, on_floor),
                                             [&](double, std::string_view) { return --left > 0; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().text(), kCancelled);
  }
}

TEST(Gfdm, QuadraticFieldIsExact) {
  // Taylor fits, balance and stabilised tractions are all exact for it.
  const test::Body body = test::jittered_cube(6, 0.3);
  const QuadraticField field;
  const auto unknowns =
      solve_static(gfdm_formulation(), body.problem(kSoft, on_floor), field.loads(kSoft));
  EXPECT_LT(largest_nodal_error(unknowns, body.cloud, field), 1e-11);
}

TEST(Gfdm, OwnUnknownsAreDisplacements) {
  EXPECT_TRUE(gfdm_formulation().interpolates());
  EXPECT_FALSE(paper_formulation().interpolates());
}

TEST(Gfdm, ComplianceOfABallIsPositiveAndNearlySymmetric) {
  const test::Body body = small_ball();
  const auto solver = gfdm_formulation().prepare(body.problem(kSoft, in_lower_part), no_progress());
  ASSERT_TRUE(solver) << solver.error().text();
  const std::vector<int> top = upper_surface(body);
  const auto compliance = (*solver)->compliance(test::nodes_as_places(top),
                                                test::first_indices(top.size()), no_progress());
  ASSERT_TRUE(compliance);
  const auto n = static_cast<Eigen::Index>(3 * top.size());
  const MatrixX square =
      Eigen::Map<const Eigen::MatrixXf>(compliance->columns.data(), n, n).cast<double>();
  EXPECT_LT((square - square.transpose()).norm(), 0.15 * square.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(0.5 * (square + square.transpose()))
                .eigenvalues()
                .minCoeff(),
            0.0);
}

TEST(Gfdm, AnswersToForcesAreThoseOfGalerkin) {
  // 1 N in all, spread over the nodes of a cap by their areas; the displacement there, node by
  // node, against the weak form's with the same traction. A wrong area or volume shows as a factor.
  const test::Body body = small_ball();
  const auto in_cap = [](const Vec3& x) { return x.z() > 0.03; };
  const double cap_area = 2.0 * std::numbers::pi * 0.05 * 0.02;
  const auto solver = gfdm_formulation().prepare(body.problem(kSoft, in_lower_part), no_progress());
  ASSERT_TRUE(solver);
  std::vector<double> unknowns(3 * body.cloud.size(), 0.0);
  std::vector<std::size_t> cap;
  for (std::size_t i = 0; i < body.cloud.surface_count; ++i) {
    if (in_cap(body.cloud.positions[i])) cap.push_back(i);
  }
  for (const std::size_t i : cap) unknowns[3 * i + 2] = -1.0 / static_cast<double>(cap.size());
  ASSERT_TRUE((*solver)->solve(unknowns, 1));

  StaticLoads loads;
  loads.traction = [&](const Vec3& x, const Vec3&) {
    return in_cap(x) ? Vec3(0.0, 0.0, -1.0 / cap_area) : Vec3(Vec3::Zero());
  };
  const auto weak =
      solve_static(*find_formulation("galerkin"), body.problem(kSoft, in_lower_part), loads);
  ASSERT_TRUE(weak);
  const ShapeFunctions fields = find_formulation("galerkin")->fields(body.cloud);
  double strong_mean = 0.0, weak_mean = 0.0;
  ShapeValues at;
  for (const std::size_t i : cap) {
    strong_mean += unknowns[3 * i + 2];
    fields.evaluate(body.cloud.positions[i], false, at);
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      weak_mean += at.values[j] * (*weak)[3 * static_cast<std::size_t>(at.nodes[j]) + 2];
    }
  }
  EXPECT_NEAR(strong_mean / weak_mean, 1.0, 0.2);
}

TEST(Gfdm, IsRefusedNearIncompressibility) {
  const test::Body body = test::jittered_cube(5, 0.1);
  EXPECT_TRUE(gfdm_formulation().prepare(body.problem({10e3, 0.45}, on_floor), no_progress()));
  const auto refused =
      gfdm_formulation().prepare(body.problem({10e3, 0.46}, on_floor), no_progress());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("at most 0.45"), std::string::npos);
  EXPECT_NE(refused.error().text().find("galerkin"), std::string::npos);
  const auto impossible =
      gfdm_formulation().prepare(body.problem({10e3, 0.5}, on_floor), no_progress());
  ASSERT_FALSE(impossible);
  EXPECT_NE(impossible.error().text().find("less than 0.5"), std::string::npos);
}

TEST(Gfdm, RefusesFewerNodesThanAQuadraticNeeds) {
  test::Body sparse{test::cube(1.0, 2), {}};
  for (const double x : {-.5, .5}) {
    for (const double y : {-.5, .5}) {
      for (const double z : {-.5, .5}) sparse.cloud.positions.emplace_back(x, y, z);
    }
  }
  sparse.cloud.surface_count = 8;
  sparse.cloud.spacings.assign(8, 1.0);
  const auto refused = gfdm_formulation().prepare(sparse.problem(kSoft, on_floor), no_progress());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("smaller node spacing"), std::string::npos)
      << refused.error().text();
}

TEST(Paper, WarnsThatItDoesNotConverge) {
  EXPECT_NE(paper_formulation().warning().find("doesn't converge"), std::string::npos);
  EXPECT_TRUE(gfdm_formulation().warning().empty());
}

TEST(Paper, SecondDerivativesAreInconsistent) {
  // What its warning says: a quadratic field is missed by far, and no nearer with more nodes.
  const QuadraticField field;
  for (const int cells : {5, 8}) {
    const test::Body body = test::jittered_cube(cells, 0.2);
    const auto unknowns =
        solve_static(paper_formulation(), body.problem(kSoft, on_floor), field.loads(kSoft));
    EXPECT_GT(largest_nodal_error(unknowns, body.cloud, field), 0.1);
  }
}

}  // namespace
}  // namespace viscera
