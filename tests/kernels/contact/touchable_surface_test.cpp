#include "kernels/contact/touchable_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

PointCloud cloud_in(const TriangleSurface& surface, double spacing) {
  const SurfaceTree tree(surface);
  auto cloud = place_nodes(
      surface, tree, [=](const Vec3&) { return spacing; }, NodePlacement{}, no_progress());
  EXPECT_TRUE(cloud) << cloud.error().text();
  return cloud ? *cloud : PointCloud{};
}

const auto kEverywhere = [](const Vec3&) { return true; };

class Plate : public ::testing::Test {
 protected:
  static constexpr double kSpacing = 3e-3;
  TriangleSurface surface = test::box(Vec3(0.06, 0.06, 0.006), 12);
  ShapeFunctions fields{cloud_in(surface, kSpacing), 1.8};
  std::vector<int> nodes;
};

TEST_F(Plate, SamplesCarryTheWholeTouchableArea) {
  const auto all = sample_touchable_surface(surface, kEverywhere, fields, nodes);
  ASSERT_TRUE(all) << all.error().text();
  EXPECT_NEAR(std::accumulate(all->areas.begin(), all->areas.end(), 0.0), area(surface), 1e-12);
  EXPECT_TRUE(std::is_sorted(nodes.begin(), nodes.end()));
  for (std::size_t s = 0; s < all->size(); ++s) {
    double sum = 0.0;
    for (int e = all->weights.row_begin[s]; e < all->weights.row_begin[s + 1]; ++e) {
      sum += all->weights.values[static_cast<std::size_t>(e)];
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(all->spacings[s], kSpacing, 0.4 * kSpacing);
  }
}

TEST_F(Plate, SpreadLoadKeepsItsSumItsCentreAndItsWidth) {
  const auto touch = sample_touchable_surface(surface, kEverywhere, fields, nodes);
  ASSERT_TRUE(touch);
  const double sigma = 0.85 * kSpacing;
  std::vector<SampleShare> shares;
  for (int i = 0; i < 20; ++i) {
    const Vec3 x(1.7e-3 * std::sin(i), 2.3e-3 * std::cos(2.0 * i), 0.003);
    ASSERT_TRUE(spread_load(*touch, x, Vec3::UnitZ(), sigma, shares));
    double sum = 0.0, spread2 = 0.0;
    Vec3 centre = Vec3::Zero();
    for (const auto& [sample, share] : shares) {
      const Vec3 offset = touch->positions[static_cast<std::size_t>(sample)] - x;
      sum += share;
      centre += share * offset;
      spread2 += 0.5 * share * offset.squaredNorm();
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_LT(centre.norm(), 1e-4 * sigma);
    EXPECT_NEAR(std::sqrt(spread2), sigma, 0.08 * sigma);
  }
}

TEST_F(Plate, LoadStaysOnItsSideOfAThinBody) {
  const auto touch = sample_touchable_surface(surface, kEverywhere, fields, nodes);
  ASSERT_TRUE(touch);
  std::vector<SampleShare> shares;
  ASSERT_TRUE(spread_load(*touch, Vec3(0, 0, 0.003), Vec3::UnitZ(), 4e-3, shares));
  for (const auto& [sample, share] : shares) {
    EXPECT_GT(touch->positions[static_cast<std::size_t>(sample)].z(), 0.0);
  }
}

TEST_F(Plate, SharesStayPositiveAtTheBorderOfTheTouchableRegion) {
  const auto touch = sample_touchable_surface(
      surface, [](const Vec3& x) { return x.x() > 0.0 && x.z() > 0.0; }, fields, nodes);
  ASSERT_TRUE(touch);
  std::vector<SampleShare> shares;
  ASSERT_TRUE(spread_load(*touch, Vec3(0.2e-3, 0, 0.003), Vec3::UnitZ(), 2.5e-3, shares));
  for (const auto& [sample, share] : shares) EXPECT_GT(share, 0.0);
}

TEST_F(Plate, PlaceFarFromTheTouchableRegionTakesTheNearestSample) {
  const auto touch = sample_touchable_surface(
      surface, [](const Vec3& x) { return x.x() > 0.02 && x.z() > 0.0; }, fields, nodes);
  ASSERT_TRUE(touch);
  std::vector<SampleShare> shares;
  EXPECT_FALSE(spread_load(*touch, Vec3(-0.03, 0, 0.003), Vec3::UnitZ(), 2.5e-3, shares));
  ASSERT_EQ(shares.size(), 1u);
  EXPECT_EQ(shares[0].share, 1.0);
  for (const Vec3& x : touch->positions) {
    const Vec3& chosen = touch->positions[static_cast<std::size_t>(shares[0].sample)];
    EXPECT_LE((chosen - Vec3(-0.03, 0, 0.003)).norm(), (x - Vec3(-0.03, 0, 0.003)).norm());
  }
}

TEST_F(Plate, NothingTouchableIsRefused) {
  const auto touch = sample_touchable_surface(
      surface, [](const Vec3&) { return false; }, fields, nodes);
  ASSERT_FALSE(touch);
  EXPECT_NE(touch.error().text().find("expected at least one"), std::string::npos);
}

TEST_F(Plate, SurfaceBeyondTheCloudIsRefusedWithThePlace) {
  TriangleSurface elsewhere = surface;
  for (Vec3& vertex : elsewhere.vertices) vertex.x() += 1.0;
  const auto touch = sample_touchable_surface(elsewhere, kEverywhere, fields, nodes);
  ASSERT_FALSE(touch);
  EXPECT_NE(touch.error().text().find("mm"), std::string::npos);
}

TEST(TouchableSurface, FineTrianglesShareSamples) {
  const TriangleSurface fine = test::icosphere(0.02, 5);  // edges of about 0.75 mm
  const ShapeFunctions fields(cloud_in(fine, 4e-3), 1.8);
  std::vector<int> nodes;
  const auto touch = sample_touchable_surface(fine, kEverywhere, fields, nodes);
  ASSERT_TRUE(touch);
  EXPECT_LT(touch->size(), fine.triangles.size() / 4);
  EXPECT_NEAR(std::accumulate(touch->areas.begin(), touch->areas.end(), 0.0), area(fine), 1e-12);
}

}  // namespace
}  // namespace viscera
