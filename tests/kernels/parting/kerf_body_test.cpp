// Blocks that blades have cut, against finite elements: from the blade's way to the force.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/verification/cut_block.h"

namespace viscera {
namespace {

constexpr double kSpacing = 3e-3;  // [m]

/// A block cut so, after its nodes were placed; null: it is whole.
CutBlock cut_block(void (*cut)(TissueShare&), double spacing, std::uint64_t seed) {
  CutBlock block = CutBlock::whole(spacing, seed).value();
  if (cut) {
    TissueShare tissue(CutBlock::kKerfVoxel);
    cut(tissue);
    block.take(tissue, spacing).value();
  }
  return block;
}

/// At each end of the block [N].
double force_of(void (*cut)(TissueShare&), std::uint64_t seed) {
  return pull(cut_block(cut, kSpacing, seed).assemble(CutBlock::is_end).value()).value().force;
}

class KerfBody : public testing::TestWithParam<Kerf> {};
INSTANTIATE_TEST_SUITE_P(Kerfs, KerfBody, testing::ValuesIn(kKerfs),
                         [](const auto& info) { return info.param.name; });

TEST_P(KerfBody, IsSofterByWhatFiniteElementsSay) {
  const double expected = 1.0 / GetParam().force - 1.0 / kWholeForce;
  double mean = 0.0;
  for (const std::uint64_t seed : {11, 12}) {
    const double added = 1.0 / force_of(GetParam().cut, seed) - 1.0 / force_of(nullptr, seed);
    EXPECT_NEAR(added, expected, 0.08 * expected) << seed;
    mean += 0.5 * (added / expected - 1.0);
  }
  RecordProperty("added_compliance_error", std::to_string(mean));
}

class SeveredBody : public testing::TestWithParam<Kerf> {};
INSTANTIATE_TEST_SUITE_P(Kerfs, SeveredBody, testing::ValuesIn(kSeveringKerfs),
                         [](const auto& info) { return info.param.name; });

TEST_P(SeveredBody, HasAPieceThatMovesWithoutForce) {
  const double h = 4e-3;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto assembled = cut_block(GetParam().cut, h, seed).assemble([](const Vec3& x) {
      return CutBlock::is_end(x) && x.x() < 0.0;
    });
    ASSERT_TRUE(assembled) << seed << ": " << assembled.error().text();
    const auto energy = energy_of_free_piece(*assembled, h);
    ASSERT_TRUE(energy) << seed << ": " << energy.error().text();
    EXPECT_LT(*energy, 1e-10) << seed;
  }
}

}  // namespace
}  // namespace viscera
