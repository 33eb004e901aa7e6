#include "kernels/paff/preparation_cost.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <limits>
#include <utility>

#include "kernels/base/sanitized.h"
#include "kernels/paff/stiffness_factor.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/resident_memory.h"

namespace viscera {
namespace {

constexpr double kRadius = 25e-3;

bool at_bottom(const Vec3& x) {
  return x.z() < -0.8 * kRadius;
}

test::Body ball(double spacing) {
  return test::placed_body(test::icosphere(kRadius, 4), [spacing](const Vec3&) { return spacing; });
}

struct Case {
  const char* what;
  const Formulation& formulation;
  Basis basis;
  double poisson_ratio, spacing;
};

TEST(PreparationCost, CountsWhatPreparationMakes) {
  const Case cases[] = {
      {"linear", galerkin_formulation(), Basis::kLinear, 0.3, 3.4e-3},
      {"averaged", galerkin_formulation(), Basis::kLinear, 0.45, 3.4e-3},
      {"quadratic", galerkin_quadratic_formulation(), Basis::kQuadratic, 0.3, 5e-3},
      {"quadratic, averaged", galerkin_quadratic_formulation(), Basis::kQuadratic, 0.45, 5e-3},
  };
  for (const Case& one : cases) {
    const test::Body body = ball(one.spacing);
    const IsotropicMaterial material{1e4, one.poisson_ratio};
    const auto system = GalerkinSystem::assemble(body.problem(material, at_bottom), one.basis,
                                                 one.formulation.support_factor(), no_progress());
    ASSERT_TRUE(system) << one.what;
    const SymmetricPattern& made = system->stiffness().pattern;
    const PreparationCost cost = preparation_cost(body.cloud, one.formulation.coupling(material));
    const double blocks = static_cast<double>(made.columns.size());
    const double entries =
        static_cast<double>(dissect(body.cloud.positions, made).factor_entries(3));
    std::printf("%s: %zu nodes, blocks %.3f, entries %.3f of those made\n", one.what,
                body.cloud.size(), static_cast<double>(cost.stiffness_blocks) / blocks,
                static_cast<double>(cost.factor_entries) / entries);
    EXPECT_NEAR(static_cast<double>(cost.stiffness_blocks) / blocks, 1.0, 0.15) << one.what;
    EXPECT_NEAR(static_cast<double>(cost.factor_entries) / entries, 1.0, 0.15) << one.what;
  }
}

/// Two leaves of one and two nodes under a root of one.
Dissection three_fronts() {
  Dissection dissection;
  dissection.fronts.resize(3);
  dissection.fronts[0] = {.first = 0, .last = 1, .parent = 2, .children = {}, .border = {3}};
  dissection.fronts[1] = {.first = 1, .last = 3, .parent = 2, .children = {}, .border = {3}};
  dissection.fronts[2] = {.first = 3, .last = 4, .parent = -1, .children = {0, 1}, .border = {}};
  return dissection;
}

TEST(PreparationCost, EliminationHoldsWhatItKeepsAndWhatWaits) {
  // Kept: 3 x 6, 6 x 9 and 3 x 3 numbers. Waiting: 3 x 3 of each leaf until the root takes them.
  EXPECT_EQ(elimination_bytes(three_fronts(), 4, 1), 4u * (18 + 54 + 9 + 18));
}

TEST(PreparationCost, MoreThreadsHaveMoreWaiting) {
  const test::Body body = ball(4e-3);
  const Dissection dissection =
      dissect(body.cloud.positions,
              GalerkinSystem::assemble(body.problem({1e4, 0.3}, at_bottom), 1.8, no_progress())
                  ->stiffness()
                  .pattern);
  const std::size_t one = elimination_bytes(dissection, 8, 1);
  EXPECT_GT(elimination_bytes(dissection, 8, 16), one);
  EXPECT_GT(one, 8 * dissection.factor_entries(3));
}

TEST(PreparationCost, FactoringTakesWhatEliminationOnPaperSays) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps memory that was given back";
  const test::Body body = ball(2.8e-3);
  const auto system =
      GalerkinSystem::assemble(body.problem({1e4, 0.45}, at_bottom), 1.8, no_progress());
  ASSERT_TRUE(system);
  const Dissection dissection = dissect(body.cloud.positions, system->stiffness().pattern);
  const int threads = oneapi::tbb::this_task_arena::max_concurrency();
  for (const auto& [precision, real_bytes] :
       {std::pair(FactorPrecision::kSingle, 4), std::pair(FactorPrecision::kFull, 8)}) {
    if (!test::forget_greatest()) GTEST_SKIP() << "the kernel doesn't count anew";
    const double before = test::resident("VmRSS");
    const auto factor = StiffnessFactor::factor(system->stiffness(), body.cloud.positions,
                                                precision, std::numeric_limits<std::size_t>::max());
    ASSERT_TRUE(factor);
    const double taken = test::resident("VmHWM") - before;
    const auto said = static_cast<double>(
        elimination_bytes(dissection, static_cast<std::size_t>(real_bytes), threads));
    std::printf("%zu nodes, numbers of %d bytes: %.0f MB of %.0f MB said\n", body.cloud.size(),
                real_bytes, 1e-6 * taken, 1e-6 * said);
    EXPECT_LT(taken, 1.1 * said + 20e6);  // and what the allocator and threads hold
    EXPECT_GT(taken, 0.5 * said);
  }
}

}  // namespace
}  // namespace viscera
