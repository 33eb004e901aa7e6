#include "kernels/finite/unloaded_shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>

#include "kernels/finite/finite_solver.h"
#include "kernels/paff/nodal_measures.h"
#include "tests/kernels/finite/finite_cube.h"

namespace viscera {
namespace {

constexpr double kDensity = 1000.0;

/// A body that is held somewhere, all that is prepared of it.
struct Weighed {
  NodedBody body;
  std::unique_ptr<GalerkinSystem> system;
  ElasticRegion region;
  SymmetricBlockMatrix hold;
  std::vector<double> volumes;

  static Weighed make(NodedBody body, const IsotropicMaterial& material,
                      const std::function<bool(const Vec3&)>& is_held) {
    Weighed made{std::move(body), nullptr, {}, {}, {}};
    ElasticProblem problem = made.body.problem(material, is_held);
    // Across air, too: the bent bar is hollow by less than a spacing.
    problem.fields = std::make_shared<const ShapeFunctions>(made.body.cloud, 1.8, Basis::kLinear);
    auto system = GalerkinSystem::assemble(problem, 1.8, Cube::no_progress());
    EXPECT_TRUE(system.has_value());
    made.system = std::make_unique<GalerkinSystem>(std::move(*system));
    made.region = *made.system->region([](const Vec3&) { return true; });
    made.hold = *made.system->hold();
    made.body.cloud = made.system->fields().cloud();
    made.volumes = *nodal_volumes(made.body.surface, made.body.cloud, made.system->fields());
    return made;
  }

  double volume() const { return std::accumulate(volumes.begin(), volumes.end(), 0.0); }

  FiniteSolver solver(double density = kDensity) const {
    FiniteOptions options;
    options.density = density;
    options.dynamic = false;
    auto made =
        FiniteSolver::prepare(std::make_shared<const FiniteBody>(*FiniteBody::create(region, hold)),
                              body.cloud.positions, volumes, options);
    EXPECT_TRUE(made.has_value()) << (made ? "" : made.error().text());
    return made->with(200, 1e-14);
  }

  std::vector<double> weight(const Vec3& gravity) const {
    std::vector<double> forces;
    for (const double volume : volumes)
      for (Eigen::Index k = 0; k < 3; ++k) forces.push_back(kDensity * volume * gravity[k]);
    return forces;
  }

  Result<UnloadedShape> unloaded(const Vec3& gravity) const {
    const FiniteSolver at_rest = solver();
    return find_unloaded_shape(region, hold, weight(gravity), [&](const VectorX& forces) {
      VectorX moved(forces.size());
      const auto size = static_cast<std::size_t>(forces.size());
      at_rest.factor()->apply({forces.data(), size}, {moved.data(), size});
      return moved;
    });
  }

  /// Mean of nodal displacements on a face.
  Vec3 mean_where(const std::vector<double>& u,
                  const std::function<bool(const Vec3&)>& lies) const {
    Vec3 sum = Vec3::Zero();
    double count = 0.0;
    for (std::size_t i = 0; i < body.cloud.size(); ++i)
      if (lies(body.cloud.positions[i])) {
        sum += Vec3::Map(u.data() + 3 * i);
        count += 1.0;
      }
    return sum / count;
  }
};

/// A bar of the law under a force along it, by its stretch: the one across is free.
struct Stretched {
  double mu, lambda;
  double across_squared(double stretch) const {
    return (1.0 + mu * (stretch - 1.0) / ((lambda + mu) * stretch)) / stretch;
  }
  /// Over the cross-section without stress [Pa].
  double pull(double stretch) const {
    const double across = across_squared(stretch);
    return mu * stretch + across * ((lambda + mu) * (stretch * across - 1.0) - mu);
  }
  /// That over the one of its image.
  double stretch_imaged_under(double pull_of_image) const {
    return stretch_where([&](double s) { return pull(s) / across_squared(s) - pull_of_image; });
  }
  double stretch_under(double pull_of_it) const {
    return stretch_where([&](double s) { return pull(s) - pull_of_it; });
  }
  static double stretch_where(const std::function<double(double)>& is_zero) {
    double low = 0.3, high = 3.0;
    for (int i = 0; i < 60; ++i)
      (is_zero(0.5 * (low + high)) > 0.0 ? high : low) = 0.5 * (low + high);
    return 0.5 * (low + high);
  }
};

constexpr double kLength = 0.09, kWidth = 0.03;

/// Held at its upper end, z = 0; 4 kPa.
Weighed bar(double poisson_ratio) {
  const auto lines = [](double from, double to, int parts) {
    std::vector<double> all;
    for (int i = 0; i <= parts; ++i) all.push_back(from + (to - from) * i / parts);
    return all;
  };
  const auto across = lines(-0.5 * kWidth, 0.5 * kWidth, 5);
  return Weighed::make(test::placed_body(lined_box(across, across, lines(-kLength, 0.0, 15)),
                                         [](const Vec3&) { return 6e-3; }),
                       {4e3, poisson_ratio}, [](const Vec3& x) { return x.z() > -1e-9; });
}

TEST(UnloadedShape, ABarThatHungInItsImageIsShorterByTheExactLengthAndStretchesOnAsItShould) {
  // Of this Poisson's ratio what holds it doesn't narrow it.
  const Weighed body = bar(0.0);
  const Vec3 gravity(0, 0, -9.81);
  const auto unloaded = body.unloaded(gravity);
  ASSERT_TRUE(unloaded) << unloaded.error().text();
  EXPECT_LT(unloaded->off, kStillOff);
  const IsotropicMaterial material{4e3, 0.0};
  // The energy's constants: those of small strains in stable neo-Hookean form (finite_body.h).
  const Stretched law{material.shear_modulus(), material.lame_lambda()};
  double shorter = 0.0, longer = 0.0;
  constexpr int kParts = 4000;
  for (int i = 0; i < kParts; ++i) {
    const double below = kLength * (i + 0.5) / kParts;
    const double pull = kDensity * 9.81 * below;
    const double hung = law.stretch_imaged_under(pull);
    const double more = law.stretch_under(1.5 * pull * law.across_squared(hung));
    shorter += (1.0 / hung - 1.0) * kLength / kParts;
    longer += (more / hung - 1.0) * kLength / kParts;
  }
  EXPECT_LT(shorter, -7e-3) << "the bar is soft enough to matter";
  const auto is_end = [](const Vec3& x) { return x.z() < -kLength + 1e-9; };
  EXPECT_NEAR(body.mean_where(unloaded->displacements, is_end).z(), -shorter, -0.02 * shorter);

  // The same bar half as heavy again. (Turned over it would buckle.)
  const auto imaged = std::make_shared<const FiniteBody>(
      *FiniteBody::create(body.region, body.hold, unloaded->displacements));
  const FiniteSolver solver = body.solver().with(imaged);
  FiniteState state = solver.at_rest();
  for (int i = 0; i < 10; ++i) solver.step(state, 0.5 * gravity);
  EXPECT_NEAR(body.mean_where(state.displacements, is_end).z(), -longer, 0.02 * longer);
}

TEST(UnloadedShape, ABodyMadeOfItComesUnderItsWeightToWhereItWasImaged) {
  // Sideways: it bends.
  const Weighed imaged = bar(0.3);
  const Vec3 gravity(0.5, 0, 0);
  const auto unloaded = imaged.unloaded(gravity);
  ASSERT_TRUE(unloaded) << unloaded.error().text();
  const auto way_at = [&](const Vec3& x) {
    return imaged.system->displacement(unloaded->displacements, x);
  };
  NodedBody moved = imaged.body;
  for (Vec3& vertex : moved.surface.vertices) vertex += way_at(vertex);
  double most = 0.0;
  for (Vec3& node : moved.cloud.positions) {
    const Vec3 way = way_at(node);
    node += way;
    most = std::max(most, way.norm());
  }
  EXPECT_GT(most, 10e-3);
  const Weighed other =
      Weighed::make(std::move(moved), {4e3, 0.3}, [](const Vec3& x) { return x.z() > -1e-3; });
  const FiniteSolver solver = other.solver(kDensity * imaged.volume() / other.volume());
  FiniteState state = solver.at_rest();
  for (int i = 1; i <= 20; ++i) solver.step(state, gravity * std::min(1.0, 0.1 * i));
  double off = 0.0;
  for (const Vec3& node : imaged.body.cloud.positions) {
    const Vec3 way = way_at(node);
    off = std::max(off, (other.system->displacement(state.displacements, node + way) + way).norm());
  }
  EXPECT_LT(off, 0.03 * most);
  EXPECT_LT(off, 0.5e-3);
}

TEST(UnloadedShape, OfWeightlessTissueIsItsImage) {
  const auto unloaded = bar(0.3).unloaded(Vec3::Zero());
  ASSERT_TRUE(unloaded) << unloaded.error().text();
  EXPECT_EQ(norm(unloaded->displacements), 0.0);
  EXPECT_EQ(unloaded->iterations, 0);
}

TEST(UnloadedShape, OfTissueThatIsTooSoftForItsWeightIsRefused) {
  const auto unloaded = bar(0.3).unloaded(Vec3(0, 0, 500.0));
  ASSERT_FALSE(unloaded);
  EXPECT_TRUE(unloaded.error().text().starts_with("unloaded shape: ")) << unloaded.error().text();
}

TEST(UnloadedShape, OfAnotherSizeOrNotFiniteIsRefused) {
  const Weighed body = bar(0.3);
  std::vector<double> wrong(7, 0.0);
  EXPECT_FALSE(FiniteBody::create(body.region, body.hold, wrong));
  wrong.assign(3 * body.body.cloud.size(), 0.0);
  wrong[5] = std::nan("");
  EXPECT_FALSE(FiniteBody::create(body.region, body.hold, wrong));
}

/// Fibres and cells that average, under a weight in which it was imaged.
class ImagedCube : public testing::TestWithParam<double> {
 protected:
  ImagedCube()
      : cube_(Cube::make(GetParam(), true, {},
                         [](const Vec3&, double) {
                           return Fibres{Vec3(1, 2, 0).normalized(), 20e3};
                         })),
        n_(3 * cube_.finite.nodes()) {
    const auto region = cube_.system.region([](const Vec3&) { return true; });
    const auto hold = cube_.system.hold();
    // Not at rest in any other sense than this one.
    auto made = FiniteBody::create(*region, *hold, random_vector(n_, 0.02, 1));
    EXPECT_TRUE(made.has_value());
    cube_.finite = std::move(*made);
  }
  Cube cube_;
  std::size_t n_;
};

TEST_P(ImagedCube, HasNeitherForcesNorEnergyInItsImage) {
  const std::vector<double> still(n_, 0.0);
  EXPECT_EQ(cube_.energy(still), 0.0);
  EXPECT_EQ(norm(cube_.gradient(still)), 0.0);
}

TEST_P(ImagedCube, ForcesAreTheDerivativeOfItsEnergyAndTheTangentTheirs) {
  const std::vector<double> u = random_vector(n_, 0.03, 2), way = random_vector(n_, 1.0, 3);
  const double step = 1e-6;
  std::vector<double> ahead = u, behind = u;
  for (std::size_t i = 0; i < n_; ++i) {
    ahead[i] += step * way[i];
    behind[i] -= step * way[i];
  }
  const std::vector<double> forces = cube_.gradient(u), before = cube_.gradient(behind),
                            after = cube_.gradient(ahead);
  double along = 0.0;
  for (std::size_t i = 0; i < n_; ++i) along += forces[i] * way[i];
  EXPECT_NEAR((cube_.energy(ahead) - cube_.energy(behind)) / (2.0 * step), along,
              1e-6 * norm(forces) * norm(way));
  const MatrixX direction = Eigen::Map<const VectorX>(way.data(), static_cast<Eigen::Index>(n_));
  const MatrixX change = cube_.finite.tangent_times(cube_.finite.point_tangents(u), direction);
  double off = 0.0, size = 0.0;
  for (std::size_t i = 0; i < n_; ++i) {
    const double exact = (after[i] - before[i]) / (2.0 * step);
    off += std::pow(change(static_cast<Eigen::Index>(i), 0) - exact, 2);
    size += exact * exact;
  }
  EXPECT_LT(std::sqrt(off), 1e-5 * std::sqrt(size));
}

TEST_P(ImagedCube, HasRelaxedInItsImage) {
  const std::vector<RelaxationTerm> series = {{0.8, 0.1}, {0.6, 1.9}};
  const std::vector<SteppedTerm> terms = stepped(series, 1.0 / 60.0);
  const std::vector<double> still(n_, 0.0);
  TissueMemory memory;
  Overstress overstress;
  for (int i = 0; i < 3; ++i) overstress = cube_.finite.relax(still, {}, terms, memory);
  std::vector<double> forces(n_, 0.0);
  FiniteBody::Workspace workspace;
  const double energy = cube_.finite.energy(still, forces, workspace, {}, {}, overstress);
  const double scale = norm(cube_.gradient(random_vector(n_, 0.02, 4)));
  EXPECT_LT(norm(forces), 1e-10 * scale);
  EXPECT_LT(std::abs(energy), 1e-12 * scale);
}

TEST_P(ImagedCube, PartsAreTurnedFromWhereTheyWereImaged) {
  const std::vector<double> still(n_, 0.0);
  for (const Mat3& mean : cube_.finite.mean_gradients(still))
    EXPECT_LT((mean - Mat3::Identity()).norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, ImagedCube, testing::Values(0.3, 0.45, 0.49));

}  // namespace
}  // namespace viscera
