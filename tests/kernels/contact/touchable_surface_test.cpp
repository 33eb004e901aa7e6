#include "kernels/contact/touchable_surface.h"

#include <gtest/gtest.h>

#include <cmath>

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

class Plate : public ::testing::Test {
 protected:
  static constexpr double kSpacing = 3e-3;
  TriangleSurface surface = test::box(Vec3(0.06, 0.06, 0.006), 12);
  ShapeFunctions fields{cloud_in(surface, kSpacing), 1.8};
  SurfacePlaces places = place_on_surface(surface, fields).value();

  TouchableSurface touchable_where(const std::function<bool(const Vec3&)>& is_touchable) const {
    return touchable_part(places, is_touchable).value();
  }
  const TouchableSurface everywhere = touchable_where([](const Vec3&) { return true; });
  std::vector<LoadShare> shares;
};

TEST_F(Plate, TouchablePartKnowsItsPlaces) {
  const auto is_right = [](const Vec3& x) { return x.x() > 0.01; };
  const TouchableSurface right = touchable_where(is_right);
  EXPECT_TRUE(std::is_sorted(right.places.begin(), right.places.end()));
  std::size_t found = 0;
  for (std::size_t p = 0; p < places.size(); ++p) {
    if (!is_right(places.positions[p])) continue;
    ASSERT_LT(found, right.size());
    EXPECT_EQ(right.places[found], static_cast<int>(p));
    EXPECT_EQ(right.positions[found], places.positions[p]);
    EXPECT_EQ(right.areas[found], places.areas[p]);
    ++found;
  }
  EXPECT_EQ(found, right.size());
}

TEST_F(Plate, SpreadLoadKeepsItsSumItsCentreAndItsWidth) {
  const double sigma = 0.85 * kSpacing;
  double strayed = 0.0;
  for (int i = 0; i < 20; ++i) {
    const Vec3 x(1.7e-3 * std::sin(i), 2.3e-3 * std::cos(2.0 * i), 0.003);
    ASSERT_TRUE(spread_load(everywhere, x, Vec3::UnitZ(), sigma, shares));
    double sum = 0.0;
    Vec3 centre = Vec3::Zero();
    Mat3 spread = Mat3::Zero();
    for (const auto& [place, share] : shares) {
      const Vec3 offset = everywhere.positions[static_cast<std::size_t>(place)] - x;
      EXPECT_GT(share, 0.0);
      sum += share;
      centre += share * offset;
      spread += share * offset * offset.transpose();
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_LT(centre.norm(), 1e-4 * sigma);
    // The bell (1 - (r / R)^2)^3 with R = 3.058 sigma has the variance R^2 / 10 along each axis.
    const double variance = 0.1 * std::pow(3.058 * sigma, 2);
    EXPECT_NEAR(spread(0, 0), variance, 0.01 * variance);
    EXPECT_NEAR(spread(1, 1), variance, 0.01 * variance);
    EXPECT_NEAR(spread(0, 1), 0.0, 0.01 * variance);
    strayed = std::max(strayed, std::abs(spread(0, 0) - spread(1, 1)));
  }
  EXPECT_LT(strayed, 0.01 * sigma * sigma);
}

TEST_F(Plate, SharesFollowASlidingLoadWithoutJumps) {
  const double sigma = 0.85 * kSpacing, step = 0.01e-3;
  std::vector<double> last(everywhere.size(), 0.0);
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(spread_load(everywhere, Vec3(i * step, 0.2 * i * step, 0.003), Vec3::UnitZ(), sigma,
                            shares));
    std::vector<double> now(everywhere.size(), 0.0);
    for (const auto& [place, share] : shares) now[static_cast<std::size_t>(place)] = share;
    for (std::size_t p = 0; p < now.size() && i > 0; ++p) {
      EXPECT_NEAR(now[p], last[p], 0.5 * step / sigma);
    }
    last = now;
  }
}

TEST_F(Plate, LoadStaysOnItsSideOfAThinBody) {
  ASSERT_TRUE(spread_load(everywhere, Vec3(0, 0, 0.003), Vec3::UnitZ(), 4e-3, shares));
  for (const auto& [place, share] : shares) {
    EXPECT_GT(everywhere.positions[static_cast<std::size_t>(place)].z(), 0.0);
  }
}

TEST_F(Plate, SharesStayPositiveAtTheBorderOfTheTouchableRegion) {
  const TouchableSurface half =
      touchable_where([](const Vec3& x) { return x.x() > 0.0 && x.z() > 0.0; });
  for (const double x : {0.2e-3, 2e-3, 4e-3}) {
    ASSERT_TRUE(spread_load(half, Vec3(x, 0, 0.003), Vec3::UnitZ(), 2.5e-3, shares));
    double sum = 0.0;
    for (const auto& [place, share] : shares) {
      EXPECT_GT(share, 0.0);
      sum += share;
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
  }
}

TEST_F(Plate, PositionFarFromTheTouchableRegionTakesTheNearestPlace) {
  const TouchableSurface far =
      touchable_where([](const Vec3& x) { return x.x() > 0.02 && x.z() > 0.0; });
  const Vec3 x(-0.03, 0, 0.003);
  EXPECT_FALSE(spread_load(far, x, Vec3::UnitZ(), 2.5e-3, shares));
  ASSERT_EQ(shares.size(), 1u);
  EXPECT_EQ(shares[0].share, 1.0);
  const Vec3& chosen = far.positions[static_cast<std::size_t>(shares[0].place)];
  for (const Vec3& other : far.positions) EXPECT_LE((chosen - x).norm(), (other - x).norm());
}

TEST_F(Plate, NothingTouchableIsRefused) {
  const auto touch = touchable_part(places, [](const Vec3&) { return false; });
  ASSERT_FALSE(touch);
  EXPECT_NE(touch.error().text().find("expected at least one"), std::string::npos);
}

}  // namespace
}  // namespace viscera
