#include "kernels/finite/relaxation.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <memory>

#include "engine/verification/lifted_body.h"
#include "kernels/base/archive.h"
#include "kernels/hive/prony.h"
#include "tests/kernels/finite/finite_cube.h"

namespace viscera {
namespace {

constexpr double kStep = 1.0 / 60.0;
/// Shares of the long-term modulus: .8 and .6 are g of 1/3 and 1/4 of the instantaneous one.
const std::vector<RelaxationTerm> kTwoTerms = {{0.8, 0.1}, {0.6, 1.9}};

std::vector<double> times(std::vector<double> u, double factor) {
  for (double& one : u) one *= factor;
  return u;
}

/// A cube that has been deformed, step by step.
struct Past {
  const Cube& cube;
  std::vector<SteppedTerm> terms = stepped(kTwoTerms, kStep);
  ChangedTissue changed;
  TissueMemory memory;

  Overstress after(std::span<const double> u, int steps = 1) {
    Overstress last;
    for (int i = 0; i < steps; ++i) last = cube.finite.relax(u, changed, terms, memory);
    return last;
  }
  double energy(std::span<const double> u, const Overstress& overstress,
                std::vector<double>* gradient = nullptr, const Viscosity& viscosity = {}) const {
    FiniteBody::Workspace workspace;
    if (gradient) gradient->assign(u.size(), 0.0);
    return cube.finite.energy(u, gradient ? std::span<double>(*gradient) : std::span<double>(),
                              workspace, viscosity, changed, overstress);
  }
};

class Relaxation : public testing::TestWithParam<double> {};

TEST_P(Relaxation, SmallStrainsMeetTheForcesOfTheSeriesThatAHandFeels) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> shape = random_vector(3 * cube.finite.nodes(), 1e-8, 1);
  const std::vector<double> elastic = cube.gradient(shape);
  Past past{cube};
  const std::array<PronyTerm, 2> series = {PronyTerm{0.8 / 2.4, 0.1}, PronyTerm{0.6 / 2.4, 1.9}};
  PronyForce felt(series);
  // Pressed within five steps, kept, let go halfway.
  double before = 0.0;
  for (int step = 1; step <= 40; ++step) {
    const double now = step > 25 ? 0.5 : std::min(1.0, 0.2 * step);
    const Overstress overstress = past.after(times(shape, before));
    std::vector<double> forces;
    past.energy(times(shape, now), overstress, &forces);
    const double expected = felt.update(now, kStep);
    EXPECT_LT(distance(forces, times(elastic, expected)), 1e-6 * norm(elastic)) << step;
    if (step == 5) {
      EXPECT_GT(expected, 1.8);
    }
    before = now;
  }
}

TEST_P(Relaxation, ForcesAreTheDerivativeOfTheEnergyWhateverTheTissueRemembers) {
  const Cube cube = Cube::make(GetParam());
  const std::size_t n = 3 * cube.finite.nodes();
  Past past{cube};
  TissueChange change{random_vector(cube.finite.points(), 1.0, 2),
                      random_vector(cube.finite.points(), 0.03, 3)};
  for (double& one : change.stiffness) one += 2.0;
  for (double& one : change.shrinkage) one += 0.03;
  const Strains strains = cube.finite.strains(random_vector(n, 0.02, 5));
  for (const bool changes : {false, true}) {
    if (changes) past.changed = cube.finite.changed(change);
    past.after(random_vector(n, 0.04, 4), 3);
    const Overstress overstress = past.after(random_vector(n, 0.04, 6), 2);
    const std::vector<double> u = random_vector(n, 0.04, 7), way = random_vector(n, 1.0, 8);
    const Viscosity viscosity{1.2, strains};
    std::vector<double> g, ahead = u, behind = u;
    past.energy(u, overstress, &g, viscosity);
    const double step = 1e-6;
    double exact = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      exact += g[i] * way[i];
      ahead[i] += step * way[i];
      behind[i] -= step * way[i];
    }
    const double difference = (past.energy(ahead, overstress, nullptr, viscosity) -
                               past.energy(behind, overstress, nullptr, viscosity)) /
                              (2.0 * step);
    EXPECT_NEAR(difference, exact, 1e-7 * norm(g) * norm(way)) << changes;
  }
}

TEST_P(Relaxation, WhatIsKeptDeformedComesToTheForcesAndTheEnergyOfTheLongTermLaw) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.04, 9);
  Past past{cube};
  std::vector<double> forces;
  const double at_once = past.energy(u, past.after(std::vector<double>(u.size(), 0.0)), &forces);
  EXPECT_GT(norm(forces), 1.8 * norm(cube.gradient(u)));
  EXPECT_GT(at_once, 1.8 * cube.energy(u));
  const Overstress overstress = past.after(u, 4000);
  past.energy(u, overstress, &forces);
  EXPECT_LT(distance(forces, cube.gradient(u)), 1e-9 * norm(forces));
}

TEST_P(Relaxation, TurningABodyTurnsItsForcesWhateverItRemembers) {
  const Cube cube = Cube::make(GetParam(), false);
  Mat3 stretch;
  stretch << 1.2, 0.1, 0.0, 0.0, 0.9, -0.1, 0.05, 0.0, 1.0;
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const auto shaped = [&](const Mat3& f) {
    return cube.moved([&](const Vec3& x) { return Vec3(f * x + 0.1 * Vec3::Ones()); });
  };
  Past past{cube}, turned{cube};
  std::vector<double> one, other;
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.02, 10);
  const auto rotated = [&](const std::vector<double>& from) {
    std::vector<double> to(from.size());
    for (std::size_t i = 0; i < cube.finite.nodes(); ++i) {
      const Vec3& x = cube.body.cloud.positions[i];
      Vec3::Map(to.data() + 3 * i) = turn * (x + Vec3::Map(from.data() + 3 * i)) - x;
    }
    return to;
  };
  // One has turned since; the other was stretched and pressed where it lay.
  const double energy = past.energy(u, past.after(shaped(stretch), 7), &one);
  const double of_turned = turned.energy(rotated(u), turned.after(shaped(stretch), 7), &other);
  for (std::size_t i = 0; i < one.size(); i += 3)
    Vec3::Map(one.data() + i) = turn * Vec3::Map(one.data() + i).eval();
  EXPECT_NEAR(of_turned, energy, 1e-6 * energy);
  EXPECT_LT(distance(one, other), 1e-6 * norm(one));
}

TEST_P(Relaxation, TissueTurnedInsideOutIsRememberedByFiniteNumbers) {
  const Cube cube = Cube::make(GetParam());
  Past past{cube};
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 1.5, 11);
  const Overstress overstress = past.after(u, 20);
  EXPECT_TRUE(std::isfinite(past.energy(times(u, 0.3), overstress)));
  const std::vector<double> flat =
      cube.moved([](const Vec3& x) { return Vec3(0.0, x.y(), x.z()); });
  EXPECT_TRUE(std::isfinite(past.energy(u, past.after(flat, 20))));
}

INSTANTIATE_TEST_SUITE_P(Poisson, Relaxation, testing::Values(0.3, 0.45, 0.49));

TEST(RelaxationOf, ABodyHasTheSameBitsForAnyNumberOfThreads) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.03, 12);
  std::array<std::vector<double>, 2> forces;
  std::array<double, 2> energies{};
  for (std::size_t i = 0; i < 2; ++i) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            i == 0 ? 1 : 4);
    Past past{cube};
    past.after(u, 3);
    energies[i] = past.energy(times(u, 0.5), past.after(times(u, 1.5), 2), &forces[i]);
  }
  EXPECT_EQ(forces[0], forces[1]);
  EXPECT_EQ(energies[0], energies[1]);
}

TEST(RelaxationOf, AMemoryFitsItsBodyAlone) {
  const Cube cube = Cube::make(0.45);
  TissueMemory memory;
  EXPECT_TRUE(cube.finite.fits(memory, 2));
  cube.finite.relax(std::vector<double>(3 * cube.finite.nodes(), 0.0), {},
                    stepped(kTwoTerms, kStep), memory);
  EXPECT_TRUE(cube.finite.fits(memory, 2));
  EXPECT_FALSE(cube.finite.fits(memory, 1));
  memory.hold.pop_back();
  EXPECT_FALSE(cube.finite.fits(memory, 2));
}

/// A grip of tissue that remembers.
class RememberedGrip final : public GripTouch {
 public:
  RememberedGrip(const GripTouch& touch, const Overstress& overstress)
      : GripTouch(touch), overstress_(overstress) {}
  const Overstress& overstress() const override { return overstress_; }

 private:
  const Overstress& overstress_;
};

TEST(RelaxationOf, ALiftedBodyPullsLessAndLessUntilItPullsAsOneThatDoesntRelax) {
  const auto body_of = [](std::vector<RelaxationTerm> terms) {
    LiftedBodyOptions options{.spacing = 8e-3};
    options.solver.relaxation = std::move(terms);
    auto made = LiftedBody::prepare(options);
    EXPECT_TRUE(made);
    return std::move(*made);
  };
  const auto lift = [](const LiftedBody& body, int frames) {
    FiniteState state = body.solver().at_rest();
    TissueMemory memory;
    FiniteStep step;
    std::vector<double> pulls;
    double worst = 0.0;
    for (int frame = 1; frame <= frames; ++frame) {
      const Overstress overstress =
          body.solver().body().relax(state.displacements, {}, body.solver().terms(), memory);
      const Vec3 to = lifted(frame * kStep, 0.02, 0.5);
      RememberedGrip touch(body.held_at(to, step), overstress);
      step = body.solver().step(touch, state);
      EXPECT_TRUE(step.answered && !step.lost);
      worst = std::max(worst, step.residual);
      pulls.push_back(LiftedBody::force(step).norm());
    }
    EXPECT_LT(worst, 2.5e-4) << "the factor doesn't know how stiff a step is";
    return pulls;
  };
  const std::vector<double> elastic = lift(*body_of({}), 120);
  const std::vector<double> relaxing = lift(*body_of({{1.0, 0.15}}), 120);
  EXPECT_GT(relaxing[29], 1.15 * elastic[29]);
  for (std::size_t i = 40; i < 120; ++i) EXPECT_LE(relaxing[i], 1.001 * relaxing[i - 1]);
  EXPECT_NEAR(relaxing.back(), elastic.back(), 5e-3 * elastic.back());
}

TEST(RelaxationOf, TermsThatNoTissueHasAreRefused) {
  for (const RelaxationTerm& term :
       {RelaxationTerm{-0.1, 1.0}, RelaxationTerm{0.5, 0.0}, RelaxationTerm{0.5, std::nan("")}}) {
    LiftedBodyOptions options{.spacing = 8e-3};
    options.solver.relaxation = {term};
    const auto made = LiftedBody::prepare(options);
    ASSERT_FALSE(made);
    EXPECT_NE(made.error().text().find("relaxation: found"), std::string::npos);
  }
}

TEST(Relaxation, TheMemoryOfABodyThatGoesOnAsItselfIsTheSameAndAsAnotherOneItsPlaces) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> shape = random_vector(3 * cube.finite.nodes(), 0.02, 5);
  Past past{cube};
  past.after(shape, 4);
  Continuation same;
  for (std::size_t node = 0; node < cube.finite.nodes(); ++node)
    same.nodes.push_back(static_cast<int>(node));
  for (std::size_t point = 0; point < cube.finite.points(); ++point)
    same.points.push_back(static_cast<int>(point));
  const TissueMemory next =
      cube.finite.continued(cube.finite, past.memory, past.terms.size(), same);
  EXPECT_EQ(first_difference(next, past.memory), "");
  // All points as one of them was: every point has that one's memory.
  Continuation one = same;
  std::ranges::fill(one.points, 17);
  const TissueMemory spread =
      cube.finite.continued(cube.finite, past.memory, past.terms.size(), one);
  ASSERT_TRUE(cube.finite.fits(spread, past.terms.size()));
  const std::size_t packs = spread.points.size() / (TissueMemory::kOfPack * past.terms.size());
  for (std::size_t pack = 1; pack < packs; ++pack)
    for (std::size_t k = 0; k < 7; ++k)
      EXPECT_EQ(spread.points[pack * TissueMemory::kOfPack + 4 * k], spread.points[4 * k]);
  EXPECT_TRUE(cube.finite.continued(cube.finite, {}, past.terms.size(), same).empty());
}

}  // namespace
}  // namespace viscera
