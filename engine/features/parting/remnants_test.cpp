// What a ragged cut leaves that no node carries.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/parting/parting.h"
#include "kernels/base/random.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kHigh = 6e-3;                   // of the block's top [m]
constexpr double kHalf = 1e-3, kDeep = 0.75e-3;  // of what is ragged, from its middle's top [m]

/// Tissue of which voxels are gone at random in a box under the top.
TissueShare ragged(std::uint64_t seed, double gone) {
  TissueShare tissue(0.25e-3);
  const Random random(seed, 0);
  std::uint64_t number = 0;
  const int half = static_cast<int>(kHalf / tissue.voxel()),
            low = static_cast<int>((kHigh - kDeep) / tissue.voxel()),
            high = static_cast<int>(kHigh / tissue.voxel()) + 2;
  for (int z = low; z <= high; ++z)
    for (int y = -half; y <= half; ++y)
      for (int x = -half; x <= half; ++x)
        if (random.uniform(number++) < gone) tissue.limit({x, y, z}, 0.0);
  return tissue;
}

TEST(Remnants, OfARaggedCutWhatNoNodeCarriesGoesWithIt) {
  SceneDescription scene =
      held_bar_scene({24e-3, 14e-3, 2.0 * kHigh}, 2e-3, 0.1e-3, 4.2e-3, 4.2e-3);
  scene.organs[0].response = Response::kFinite;
  scene.organs[0].extras.set(CuttableDescription{0.25e-3});
  InstrumentDescription scalpel = straight_tool("scalpel", InstrumentKind::kScalpel, 0.5e-3,
                                                {{0.0, Vec3(0, 0, kHigh + 19e-3), 0.0, 1.0}});
  scalpel.extras.set(BladeDescription{18e-3, 0.5e-3});
  scene.instruments = {scalpel};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  const CuttableOrgan& organ = *world->all<Cuttable>()[0].organ;
  // Draws of which something is left that no node carries.
  for (const std::uint64_t seed : {2, 11}) {
    const TissueShare tissue = ragged(seed, 0.6);
    const auto cut = cut_organ(organ, tissue, {}, *organ.whole, *organ.fields);
    ASSERT_TRUE(cut) << seed << ": " << cut.error().text();
    EXPECT_GT(cut->remnants, 1e-13) << seed;
    EXPECT_LT(cut->remnants, 1e-9) << seed;
    EXPECT_EQ(surface_defects(cut->model->surface), std::vector<std::string>());
    // Nothing has come back, and nothing is gone far from what was.
    for (double x = -3e-3; x < 3e-3; x += 0.21e-3)
      for (double z = kHigh - 3e-3; z < kHigh; z += 0.17e-3) {
        const Vec3 place(x, 0.1e-3, z);
        EXPECT_LE(cut->tissue.share(place), tissue.share(place) + 1e-7);
        if (std::abs(x) > kHalf + 1.2e-3 || z < kHigh - kDeep - 1.2e-3) {
          EXPECT_EQ(cut->tissue.share(place), 1.0) << place.transpose();
        }
      }
    // What is told of it makes the same body again, as a state that is loaded needs.
    const auto again = cut_organ(organ, cut->tissue, {}, *organ.whole, *organ.fields);
    ASSERT_TRUE(again);
    EXPECT_NEAR(again->remnants, 0.0, 1e-17);
    EXPECT_EQ(again->model->surface.vertices, cut->model->surface.vertices);
  }
}

}  // namespace
}  // namespace viscera::test
