#include "kernels/points/node_placement.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/random.h"
#include "kernels/points/advancing_front.h"
#include "kernels/points/kd_tree.h"
#include "kernels/points/neighbours.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

SpacingField uniform(double h) {
  return graded_spacing(h, h, 0.0, {});
}

Result<PointCloud> place(const TriangleSurface& surface, const SpacingField& spacing,
                         const NodePlacement& options = {}) {
  return place_nodes(surface, SurfaceTree(surface), spacing, options, no_progress());
}

/// What placing promises, for any body: surface nodes on it, interior nodes below it, no two nodes
/// too near.
void expect_sound(const PointCloud& cloud, const TriangleSurface& surface,
                  const SpacingField& spacing) {
  const SurfaceTree tree(surface);
  const std::vector<int> nearest = nearest_neighbours(cloud.positions, 1);
  ASSERT_EQ(cloud.spacings.size(), cloud.size());
  ASSERT_LE(cloud.surface_count, cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& x = cloud.positions[i];
    const Vec3& other = cloud.positions[nearest[i]];
    const double h = spacing(x);
    ASSERT_GE((x - other).norm(), 0.5 * std::max(h, spacing(other))) << "node " << i;
    const double height = tree.signed_distance(x);
    if (i < cloud.surface_count) {
      ASSERT_LT(std::abs(height), 1e-12) << "surface node " << i;
    } else {
      ASSERT_LT(height, -0.49 * h) << "interior node " << i;
    }
  }
}

/// How far, in h, a place in or on the body can be from its nearest node.
double widest_gap(const PointCloud& cloud, const TriangleSurface& surface,
                  const SpacingField& spacing) {
  const SurfaceTree tree(surface);
  const KdTree nodes(cloud.positions);
  const Box box = bounds(surface);
  const Random random(31, 0);
  double widest = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 share(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2));
    Vec3 x = box.min() + share.cwiseProduct(box.sizes());
    if (tree.signed_distance(x) > 0.0) x = tree.closest(x).position;
    widest = std::max(widest, nodes.nearest_distance(x) / spacing(x));
  }
  return widest;
}

double mean_spacing_share(const PointCloud& cloud, const SpacingField& spacing) {
  double sum = 0.0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    sum += cloud.spacings[i] / spacing(cloud.positions[i]);
  }
  return sum / static_cast<double>(cloud.size());
}

TEST(NodePlacement, UniformSphereHasTheWantedSpacingWithoutGapsOrCrowding) {
  const TriangleSurface sphere = test::icosphere(0.05, 4);
  const SpacingField spacing = uniform(0.005);
  const Result<PointCloud> cloud = place(sphere, spacing);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().text();
  expect_sound(*cloud, sphere, spacing);
  EXPECT_NEAR(mean_spacing_share(*cloud, spacing), 1.08, 0.04);
  EXPECT_LT(widest_gap(*cloud, sphere, spacing), 1.05);
  // Dense packings of balls of diameter h hold 1.41 of them in h^3, loose ones about 1.
  const double per_volume =
      static_cast<double>(cloud->size()) * std::pow(0.005, 3) / volume(sphere);
  EXPECT_GT(per_volume, 0.85);
  EXPECT_LT(per_volume, 1.41);
}

TEST(NodePlacement, GradedSphereFollowsTheSpacingEverywhere) {
  const TriangleSurface sphere = test::icosphere(0.05, 4);
  const SpacingField spacing =
      graded_spacing(0.01, 0.002, 0.25, {Vec3(0.0, 0.0, 0.05), Vec3(0.01, 0.0, 0.049)});
  const Result<PointCloud> cloud = place(sphere, spacing);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().text();
  expect_sound(*cloud, sphere, spacing);
  EXPECT_LT(widest_gap(*cloud, sphere, spacing), 1.15);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const double share = cloud->spacings[i] / spacing(cloud->positions[i]);
    ASSERT_GT(share, 0.8) << i;
    ASSERT_LT(share, 1.5) << i;
  }
}

TEST(NodePlacement, CubeWithSharpEdgesIsFilled) {
  const TriangleSurface cube = test::cube(0.05, 4);
  const SpacingField spacing = uniform(0.004);
  const Result<PointCloud> cloud = place(cube, spacing);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().text();
  expect_sound(*cloud, cube, spacing);
  EXPECT_LT(widest_gap(*cloud, cube, spacing), 1.1);
}

TEST(NodePlacement, PlatesThinnerThanTwoSpacingsGetSurfaceNodes) {
  for (const double thickness : {1.9, 1.0, 0.6, 0.2}) {
    const double h = 0.004;
    const TriangleSurface plate = test::box({0.06, 0.04, thickness * h}, 6);
    const SpacingField spacing = uniform(h);
    const Result<PointCloud> cloud = place(plate, spacing);
    ASSERT_TRUE(cloud.has_value()) << thickness << ": " << cloud.error().text();
    expect_sound(*cloud, plate, spacing);
    EXPECT_GT(cloud->surface_count, 100u);
    EXPECT_LT(widest_gap(*cloud, plate, spacing), 1.2) << thickness;
    if (thickness < 1.0) {
      EXPECT_EQ(cloud->surface_count, cloud->size());
    }
  }
}

TEST(NodePlacement, SurfaceFinerThanTheSpacingIsCoveredEvenly) {
  const TriangleSurface sphere = test::icosphere(0.05, 5);
  const SpacingField spacing = uniform(0.02);
  const Result<PointCloud> cloud = place(sphere, spacing);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().text();
  expect_sound(*cloud, sphere, spacing);
  EXPECT_LT(widest_gap(*cloud, sphere, spacing), 1.1);
}

TEST(NodePlacement, ResultDoesNotDependOnTheNumberOfThreads) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const SpacingField spacing = graded_spacing(0.008, 0.003, 0.25, {Vec3(0.0, 0.0, 0.05)});
  std::vector<PointCloud> clouds;
  for (const std::size_t threads : {1, 2, 5}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    Result<PointCloud> cloud = place(sphere, spacing);
    ASSERT_TRUE(cloud.has_value()) << cloud.error().text();
    clouds.push_back(std::move(*cloud));
  }
  for (const PointCloud& cloud : clouds) {
    EXPECT_EQ(cloud.positions, clouds[0].positions);
    EXPECT_EQ(cloud.spacings, clouds[0].spacings);
    EXPECT_EQ(cloud.surface_count, clouds[0].surface_count);
  }
}

TEST(NodePlacement, AnotherSeedGivesAnotherCloud) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const Result<PointCloud> one = place(sphere, uniform(0.01));
  const Result<PointCloud> two = place(sphere, uniform(0.01), {.seed = 2});
  ASSERT_TRUE(one.has_value() && two.has_value());
  EXPECT_NE(one->positions, two->positions);
}

TEST(NodePlacement, SpacingTooCoarseForFourNodesIsRefused) {
  const Result<PointCloud> cloud = place(test::icosphere(0.05, 2), uniform(0.2));
  ASSERT_FALSE(cloud.has_value());
  EXPECT_NE(cloud.error().text().find("expected at least 4"), std::string::npos)
      << cloud.error().text();
}

TEST(NodePlacement, SpacingThatIsNotPositiveIsRefusedWithThePlace) {
  for (const double bad : {0.0, -0.001, std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    const Result<PointCloud> cloud = place(
        test::icosphere(0.05, 2), [bad](const Vec3& x) { return x.z() > 0.03 ? bad : 0.005; });
    ASSERT_FALSE(cloud.has_value()) << bad;
    EXPECT_NE(cloud.error().text().find("expected a positive, finite length"), std::string::npos)
        << cloud.error().text();
  }
}

TEST(NodePlacement, SpacingThatIsBadOnlyInsideIsRefusedToo) {
  const Result<PointCloud> cloud =
      place(test::icosphere(0.05, 2), [](const Vec3& x) { return x.norm() < 0.02 ? -1.0 : 0.005; });
  ASSERT_FALSE(cloud.has_value());
}

TEST(NodePlacement, AbsurdlyFineSpacingIsRefusedAtOnceWithTheNumberExpected) {
  const Result<PointCloud> cloud = place(test::icosphere(0.05, 3), uniform(1e-6));
  ASSERT_FALSE(cloud.has_value());
  EXPECT_NE(cloud.error().text().find("e+14 nodes expected"), std::string::npos)
      << cloud.error().text();
}

TEST(NodePlacement, LimitOnNodesHoldsNearTheEstimateToo) {
  const Result<PointCloud> cloud =
      place(test::icosphere(0.05, 3), uniform(0.005), {.max_nodes = 4000});
  ASSERT_FALSE(cloud.has_value());
  EXPECT_NE(cloud.error().text().find("more than the 4000 allowed"), std::string::npos)
      << cloud.error().text();
}

TEST(NodePlacement, EmptySurfaceIsRefused) {
  EXPECT_FALSE(place({}, uniform(0.01)).has_value());
}

TEST(NodePlacement, StopsWhenToldToAtAnyMoment) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const SurfaceTree tree(sphere);
  double last = 0.0;
  int calls = 0;
  const Progress count = [&](double fraction, std::string_view) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    ++calls;
    return true;
  };
  ASSERT_TRUE(place_nodes(sphere, tree, uniform(0.01), {}, count).has_value());
  for (int stop = 0; stop < calls; ++stop) {
    int left = stop;
    const Result<PointCloud> cloud = place_nodes(
        sphere, tree, uniform(0.01), {}, [&](double, std::string_view) { return left-- > 0; });
    ASSERT_FALSE(cloud.has_value());
    EXPECT_EQ(cloud.error().text(), kCancelled);
  }
}

TEST(NodePlacement, TheEstimateOfACubeIsItsFacesAndItsInside) {
  // 20 spacings along each edge: 6 x 400 on the faces, 8000 inside but for 0.4 h below the faces.
  const TriangleSurface cube = test::cube(0.04, 2);
  const Result<double> estimate = estimate_nodes(cube, SurfaceTree(cube), uniform(0.002));
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(*estimate, 2400 + 0.85 * (8000 - 0.4 * 2400), 0.01 * 8000);
}

TEST(NodePlacement, TheRefusalOfTooManySaysTheEstimateWhereThatIsMore) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const SpacingField spacing = uniform(0.005);
  const Result<double> estimate = estimate_nodes(sphere, SurfaceTree(sphere), spacing);
  ASSERT_TRUE(estimate);
  ASSERT_GT(*estimate, 4050.0);
  const Result<PointCloud> cloud = place(sphere, spacing, {.max_nodes = 4000});
  ASSERT_FALSE(cloud.has_value());
  EXPECT_EQ(cloud.error().text(), too_many_nodes(*estimate, 4000).text());
}

TEST(NodePlacement, SpacingIsNotAskedForFarFromTheBody) {
  const double h = 0.01;
  const Result<PointCloud> cloud = place(test::icosphere(0.05, 2), [h](const Vec3& x) {
    return x.norm() < 0.05 + 1.5 * h ? h : std::numeric_limits<double>::quiet_NaN();
  });
  EXPECT_TRUE(cloud.has_value()) << cloud.error().text();
}

TEST(NodePlacement, ProgressEndsAtItsEndWhereMoreNodesFitThanWereExpected) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const SurfaceTree tree(sphere);
  const SpacingField spacing = uniform(0.007);
  const NodePlacement options;
  const PlacementTask task{sphere, tree, spacing, options, 10.0};
  Result<PlacedNodes> nodes = cover_surface(task);
  ASSERT_TRUE(nodes);
  std::vector<double> told;
  const Progress listen = [&](double fraction, std::string_view) {
    told.push_back(fraction);
    return true;
  };
  ASSERT_TRUE(fill_inside(task, *nodes, listen));
  ASSERT_GE(told.size(), 2u) << "told each 1024 nodes";
  EXPECT_EQ(told.front(), 0.0);
  EXPECT_EQ(told.back(), 1.0);
}

TEST(GradedSpacing, GrowsLinearlyFromThePointsUpToItsLimit) {
  const SpacingField spacing =
      graded_spacing(0.01, 0.002, 0.25, {Vec3::Zero(), Vec3(1.0, 0.0, 0.0)});
  EXPECT_DOUBLE_EQ(spacing(Vec3::Zero()), 0.002);
  EXPECT_DOUBLE_EQ(spacing({0.0, 0.008, 0.0}), 0.004);
  EXPECT_DOUBLE_EQ(spacing({1.0, 0.0, 0.016}), 0.006);
  EXPECT_DOUBLE_EQ(spacing({0.5, 0.0, 0.0}), 0.01);
  EXPECT_DOUBLE_EQ(graded_spacing(0.01, 0.002, 0.25, {})(Vec3::Zero()), 0.01);
}

TEST(MeasureSpacings, IsTheEdgeOfACubicLattice) {
  std::vector<Vec3> lattice;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      for (int k = 0; k < 5; ++k) lattice.push_back(0.01 * Vec3(i, j, k));
    }
  }
  EXPECT_NEAR(measure_spacings(lattice)[62], 0.01, 1e-15);
}

}  // namespace
}  // namespace viscera
