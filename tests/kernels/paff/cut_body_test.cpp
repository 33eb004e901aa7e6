// Bodies whose surface has the walls of a cut: fields, points and cells follow from it as from any
// other gap, with nodes that were placed before the cut.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/verification/cut_block.h"

namespace viscera {
namespace {

struct Slit {
  double force = 0.0, mouth = 0.0;  // [N], [m]
  std::size_t twins = 0, in_air = 0;
};

Slit pull_slit_block(double spacing, double width, std::uint64_t seed) {
  CutBlock block = CutBlock::whole(spacing, seed).value();
  block.slit_down_to(0.0, spacing, width);
  const GalerkinSystem system = block.assemble(CutBlock::is_end).value();
  const PulledBlock pulled = pull(system).value();
  Slit slit;
  slit.force = pulled.force;
  slit.mouth = mouth_of(system, pulled, width);
  slit.twins = system.figures().twins;
  for (const Vec3& x : block.cloud.positions)
    slit.in_air += std::abs(x.x()) < 0.5 * width - 1e-5 && x.z() > 1e-5;
  return slit;
}

struct Errors {
  double force = 0.0, mouth = 0.0;  // over the answer, means of three clouds' sizes
};

Errors errors_at(double spacing) {
  Errors errors;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Slit slit = pull_slit_block(spacing, 0.02e-3, seed);
    EXPECT_GT(slit.twins, 20u);
    errors.force += std::abs(slit.force / kSlitForce - 1.0) / 3.0;
    errors.mouth += std::abs(slit.mouth / kSlitMouth - 1.0) / 3.0;
  }
  testing::Test::RecordProperty("force_error", std::to_string(errors.force));
  testing::Test::RecordProperty("mouth_error", std::to_string(errors.mouth));
  return errors;
}

TEST(CutBody, ASlitHalfThroughABlockIsAsSoftAsByFiniteElementsAtFourMillimetres) {
  const Errors errors = errors_at(4e-3);
  EXPECT_LT(errors.force, 0.03);
  EXPECT_LT(errors.mouth, 0.04);
}

TEST(CutBody, ASlitIsNearerToFiniteElementsWithFinerNodes) {
  const Errors errors = errors_at(2.5e-3);
  EXPECT_LT(errors.force, 0.02);
  EXPECT_LT(errors.mouth, 0.02);
}

TEST(CutBody, NodesThatTheCutLeavesInAirCarryWhatIsLeftAboutThem) {
  // The slit itself makes the block softer the wider it is: by a few per cent here.
  const Slit narrow = pull_slit_block(4e-3, 0.02e-3, 1), wide = pull_slit_block(4e-3, 1e-3, 1);
  EXPECT_EQ(narrow.in_air, 0u);
  EXPECT_GT(wide.in_air, 3u);
  EXPECT_LT(wide.force, narrow.force);
  EXPECT_GT(wide.force, 0.95 * narrow.force);
  EXPECT_GT(wide.mouth, narrow.mouth);
  EXPECT_LT(wide.mouth, 1.06 * narrow.mouth);
}

TEST(CutBody, GivesBackLessForceTheDeeperItIsSlitAndTheEnergyThatFiniteElementsSay) {
  // Half a millimetre a step; what the energy falls by over two.
  const double h = 4e-3, top = 0.5 * CutBlock::kHeight;
  CutBlock block = CutBlock::whole(h, 1).value();
  double before = 0.0, at_last = 0.0;
  std::size_t reference = 0;
  for (int step = 0; step <= 20; ++step) {
    const double depth = kSlitForces.front().depth + 0.5e-3 * step;
    block.slit_down_to(top - depth, h);
    const double force = pull(block.assemble(CutBlock::is_end).value()).value().force;
    if (step > 0) {
      EXPECT_LE(force, before) << depth;
    }
    before = force;
    if (step % 4 != 0) continue;
    if (reference > 0) {
      const double exact = kSlitForces[reference - 1].force - kSlitForces[reference].force;
      EXPECT_NEAR(at_last - force, exact, 0.1 * exact) << depth;
    }
    ++reference;
    at_last = force;
  }
}

TEST(CutBody, GivesWayWithoutStepsAsASlitGoesOn) {
  const double h = 4e-3;
  CutBlock block = CutBlock::whole(h, 1).value();
  double before = 0.0;
  for (int step = 0; step <= 30; ++step) {
    block.slit_along_to(-10e-3 + 0.5e-3 * step, h);
    const double force = pull(block.assemble(CutBlock::is_end).value()).value().force;
    if (step > 0) {
      EXPECT_LE(force, before) << step;
      EXPECT_GT(force, 0.99 * before) << step;
    }
    before = force;
  }
}

TEST(CutBody, APieceThatIsCutOffMovesWithoutForce) {
  const double h = 4e-3;
  CutBlock block = CutBlock::whole(h, 1).value();
  block.slit_down_to(-0.5 * CutBlock::kHeight, h, 0.5e-3);
  const auto assembled =
      block.assemble([](const Vec3& x) { return CutBlock::is_end(x) && x.x() < 0.0; });
  ASSERT_TRUE(assembled) << assembled.error().text();
  EXPECT_GT(assembled->fields().cloud().size(), block.cloud.size());
  const auto energy = energy_of_free_piece(*assembled, h);
  ASSERT_TRUE(energy) << energy.error().text();
  EXPECT_LT(*energy, 1e-10);
}

}  // namespace
}  // namespace viscera
