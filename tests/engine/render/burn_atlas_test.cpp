#include "engine/render/burn_atlas.h"

#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"

namespace viscera {
namespace {

HeatBricks bricks_of_all_space() {
  return HeatBricks(0.5e-3, {}, 1000);
}

/// A voxel that heat has dried.
void dry(HeatBrick& brick, int voxel) {
  brick.water[static_cast<std::size_t>(voxel)] = 0.0f;
  brick.harmed = true;
}

TEST(BurnAtlasTest, OnlyChangedTilesAreUploaded) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  HeatBricks bricks = bricks_of_all_space();
  for (int i = 0; i < 20; ++i) dry(*bricks.warm_up({3 * i, 0, -1}), 100);
  BurnAtlas atlas;
  EXPECT_TRUE(atlas.empty());
  atlas.update(bricks);
  EXPECT_EQ(atlas.uploaded_tiles(), 20);
  atlas.update(bricks);
  EXPECT_EQ(atlas.uploaded_tiles(), 0);
  dry(bricks.brick(7), 300);
  atlas.update(bricks);
  EXPECT_EQ(atlas.uploaded_tiles(), 1);
  bricks.brick(8).warm->excess[3] = 500.0f;
  atlas.update(bricks);
  EXPECT_EQ(atlas.uploaded_tiles(), 1) << "heat shows, too: it glows";
}

TEST(BurnAtlasTest, NeighboursShareTheirBorders) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  HeatBricks bricks = bricks_of_all_space();
  bricks.warm_up({0, 0, 0});
  bricks.warm_up({1, 0, 0});
  BurnAtlas atlas;
  atlas.update(bricks);
  dry(bricks.brick(0), 7);  // voxel (7, 0, 0) lies in the border of brick (1, 0, 0)
  atlas.update(bricks);
  EXPECT_EQ(atlas.uploaded_tiles(), 2);
}

TEST(BurnAtlasTest, GrowsPastOneLayerAndTakesAFreshField) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  HeatBricks bricks = bricks_of_all_space();
  for (int i = 0; i < 300; ++i) bricks.warm_up({i % 10, i / 10, 0});
  BurnAtlas atlas;
  atlas.update(bricks);
  EXPECT_EQ(atlas.uploaded_tiles(), 300);
  HeatBricks fresh = bricks_of_all_space();
  fresh.warm_up({-5, 2, 1});
  atlas.update(fresh);
  EXPECT_EQ(atlas.uploaded_tiles(), 1);
  EXPECT_FALSE(atlas.empty());
}

TEST(BurnAtlasTest, BricksThatCooledUnharmedGo) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  HeatBricks bricks = bricks_of_all_space();
  for (int i = 0; i < 3; ++i) bricks.warm_up({3 * i, 0, 0});
  BurnAtlas atlas;
  atlas.update(bricks);
  for (std::size_t i = 3; i-- > 0;) bricks.cool_down(i);
  atlas.update(bricks);
  EXPECT_TRUE(atlas.empty());
}

}  // namespace
}  // namespace viscera
