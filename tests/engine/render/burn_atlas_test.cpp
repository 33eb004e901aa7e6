#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"
#include "engine/render/burn_atlas.h"

namespace viscera {
namespace {

TEST(BurnAtlasTest, OnlyChangedTilesAreUploaded) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  BrickField damage(0.5e-3);
  for (int i = 0; i < 20; ++i) damage.brick(damage.ensure({3 * i, 0, -1}))[100] = 0.5f;
  BurnAtlas atlas;
  EXPECT_TRUE(atlas.empty());
  atlas.update(damage);
  EXPECT_EQ(atlas.uploaded_tiles(), 20);
  atlas.update(damage);
  EXPECT_EQ(atlas.uploaded_tiles(), 0);
  damage.brick(7)[300] = 1.0f;
  atlas.update(damage);
  EXPECT_EQ(atlas.uploaded_tiles(), 1);
}

TEST(BurnAtlasTest, NeighboursShareTheirBorders) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  BrickField damage(0.5e-3);
  damage.ensure({0, 0, 0});
  damage.ensure({1, 0, 0});
  BurnAtlas atlas;
  atlas.update(damage);
  damage.brick(0)[7] = 1.0f;  // voxel (7, 0, 0) lies in the border of brick (1, 0, 0)
  atlas.update(damage);
  EXPECT_EQ(atlas.uploaded_tiles(), 2);
}

TEST(BurnAtlasTest, GrowsPastOneLayerAndTakesAFreshField) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  BrickField damage(0.5e-3);
  for (int i = 0; i < 300; ++i) damage.ensure({i % 10, i / 10, 0});
  BurnAtlas atlas;
  atlas.update(damage);
  EXPECT_EQ(atlas.uploaded_tiles(), 300);
  BrickField fresh(0.5e-3);
  fresh.ensure({-5, 2, 1});
  atlas.update(fresh);
  EXPECT_EQ(atlas.uploaded_tiles(), 1);
  EXPECT_FALSE(atlas.empty());
}

}  // namespace
}  // namespace viscera
