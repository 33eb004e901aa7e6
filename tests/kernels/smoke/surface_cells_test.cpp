#include "kernels/smoke/surface_cells.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "engine/verification/bodies.h"
#include "kernels/base/random.h"
#include "kernels/smoke/bin.h"

namespace viscera {
namespace {

constexpr float kCell = 3e-3f;
constexpr SurfaceReach kReach = {1e-3f, 5e-3f};
constexpr double kStep = 1.0 / 60.0;

/// A half-ball of 2 cm that goes, turns and grows in a step, amid particles.
struct Scene {
  TriangleSurface shape = ringed_hemisphere(1.0, 14);
  SurfaceTopology topology{triangles(shape)};
  std::vector<Float4> particles, speeds;
  std::vector<Vec3f> corners;

  Scene() {
    for (int i = 0; i < 800; ++i) {
      const Vec3 at = 0.03 * Random(7, 0).uniform(i) * Random(8, 0).direction(i);
      particles.push_back(Float4::from((at + Vec3::Constant(0.04)).cast<float>()));
      // A few are quick.
      const double speed = std::pow(Random(9, 0).uniform(i), 8);
      speeds.push_back(Float4::from((speed * Random(10, 0).direction(i)).cast<float>()));
    }
  }
  static double reach_of(const Float4& velocity) {
    return static_cast<double>(kReach.still + kReach.time * velocity.xyz().norm());
  }
  static std::vector<SurfaceTopology::Triangle> triangles(const TriangleSurface& shape) {
    std::vector<SurfaceTopology::Triangle> made;
    for (const auto& t : shape.triangles) made.emplace_back(t[0], t[1], t[2]);
    return made;
  }
  Pose pose(double moved, double turned) const {
    return {Vec3(0.04 + moved, 0.04, 0.035),
            Quaternion(Eigen::AngleAxisd(turned, Vec3(1, 2, 0).normalized()))};
  }
  void advance(SurfaceCells& cells, double radius, const Pose& pose, std::uint64_t version = 0) {
    corners.clear();
    for (const Vec3& at : shape.vertices) corners.push_back((radius * at).cast<float>());
    const SmokeSurface surface = {1, &topology, corners, pose, version};
    cells.advance({&surface, 1}, Vec3::Zero());
  }
  Vec3 placed(double radius, const Pose& at, int vertex) const {
    return at.to_world(radius * shape.vertices[static_cast<std::size_t>(vertex)]);
  }
};

using Corners = std::tuple<float, float, float, float, float, float>;

Corners first_corners(const SurfaceTriangle& t) {
  return {t.corners[0].x, t.corners[0].y, t.corners[0].z,
          t.corners[1].x, t.corners[1].y, t.corners[1].z};
}

TEST(SurfaceCells, EveryTriangleWithinReachOfAParticleIsInItsCellWhereItIsAtThatMoment) {
  Scene scene;
  for (const double turned : {0.0, 0.05}) {
    SurfaceCells cells;
    const Pose before = scene.pose(0.0, 0.3), after = scene.pose(3e-3, 0.3 + turned);
    scene.advance(cells, 0.019, before);
    scene.advance(cells, 0.020, after);
    for (const double fraction : {0.25, 1.0}) {
      cells.build(scene.particles, scene.speeds, fraction, kStep, kCell, kReach, {});
      std::size_t expected = 0;
      for (std::size_t i = 0; i < scene.particles.size(); ++i) {
        const Float4& particle = scene.particles[i];
        const Vec3 p = particle.xyz().cast<double>();
        const std::uint32_t cell = cell_number(cells.grid(), cell_of(cells.grid(), particle));
        for (const auto& t : scene.shape.triangles) {
          std::array<Vec3, 3> at;
          for (std::size_t c = 0; c < 3; ++c)
            at[c] = (1.0 - fraction) * scene.placed(0.019, before, t[c]) +
                    fraction * scene.placed(0.020, after, t[c]);
          const double distance =
              std::min({(at[0] - p).norm(), (at[1] - p).norm(), (at[2] - p).norm(),
                        ((at[0] + at[1] + at[2]) / 3.0 - p).norm()});
          if (distance > Scene::reach_of(scene.speeds[i])) continue;
          ++expected;
          bool found = false;
          for (std::uint32_t e = cells.cell_begin()[cell]; e < cells.cell_begin()[cell + 1]; ++e) {
            const SurfaceTriangle& triangle = cells.triangles()[cells.entries()[e]];
            found = found || ((triangle.corners[0].xyz().cast<double>() - at[0]).norm() < 1e-7 &&
                              (triangle.corners[1].xyz().cast<double>() - at[1]).norm() < 1e-7);
          }
          ASSERT_TRUE(found) << turned << ' ' << fraction;
        }
      }
      EXPECT_GT(expected, 100u);
      for (std::size_t n = 0; n < cells.triangles().size(); ++n) {
        const SurfaceTriangle& triangle = cells.triangles()[n];
        EXPECT_EQ(cells.owners()[n], 0u);
        for (const Float4& corner : triangle.corners)
          EXPECT_LE((corner.xyz() - cells.balls()[n].xyz()).norm(), 1.00001f * cells.balls()[n].w);
      }
    }
  }
}

TEST(SurfaceCells, OneQuickParticleMakesNobodyElseLookFar) {
  Scene scene;
  const auto entries = [&](std::span<const Float4> speeds) {
    SurfaceCells cells;
    scene.advance(cells, 0.02, scene.pose(0.0, 0.3));
    cells.build(scene.particles, speeds, 1.0, kStep, kCell, kReach, {});
    return cells.entries().size();
  };
  std::vector<Float4> none(scene.particles.size(), Float4{}), one = none, all = none;
  one[0] = {2.0f, 0.0f, 0.0f, 0.0f};
  all.assign(all.size(), one[0]);
  EXPECT_GT(entries(one), entries(none));
  EXPECT_LT(entries(one) - entries(none), (entries(all) - entries(none)) / 20);
}

TEST(SurfaceCells, APaceIsThatOfTheFastestOrAFourthOfItOrLessThanASixteenth) {
  EXPECT_EQ(pace_of(1.0f, 1.0f), 0u);
  EXPECT_EQ(pace_of(0.07f, 1.0f), 0u);
  EXPECT_EQ(pace_of(0.0625f, 1.0f), 1u);
  EXPECT_EQ(pace_of(0.004f, 1.0f), 1u);
  EXPECT_EQ(pace_of(0.0039f, 1.0f), 2u);
  EXPECT_EQ(pace_of(0.0f, 1.0f), 2u);
  EXPECT_EQ(pace_of(0.0f, 0.0f), 2u);
}

TEST(SurfaceCells, ParticlesThatAreElsewhereHaveTheSameTriangles) {
  Scene scene;
  SurfaceCells here, elsewhere;
  for (SurfaceCells* cells : {&here, &elsewhere}) scene.advance(*cells, 0.02, scene.pose(0, 0.3));
  here.build(scene.particles, scene.speeds, 1.0, kStep, kCell, kReach, {});
  const BinParameters grid = bin_grid(scene.particles, kCell);
  const std::size_t words = (static_cast<std::size_t>(grid.size.w) + 31) / 32;
  std::vector<std::uint32_t> bits(kPaces * words, 0);
  float fastest = 0.0f;
  for (const Float4& v : scene.speeds) fastest = std::max(fastest, v.xyz().squaredNorm());
  for (std::size_t i = 0; i < scene.particles.size(); ++i) {
    const std::uint32_t cell = cell_number(grid, cell_of(grid, scene.particles[i]));
    const std::uint32_t pace = pace_of(scene.speeds[i].xyz().squaredNorm(), fastest);
    bits[pace * words + cell / 32] |= 1u << cell % 32;
  }
  elsewhere.build(grid, bits, std::sqrt(fastest), 1.0, kStep, kReach, {});
  ASSERT_GT(here.entries().size(), 0u);
  EXPECT_TRUE(std::ranges::equal(here.entries(), elsewhere.entries()));
  EXPECT_TRUE(std::ranges::equal(here.cell_begin(), elsewhere.cell_begin()));
}

TEST(SurfaceCells, NormalsOfWhatKeepsItsShapeAreThoseOfWhatDoesNotSayThatItDoes) {
  Scene scene;
  SurfaceCells says, says_nothing;
  for (int step = 0; step < 4; ++step) {
    const Pose pose = scene.pose(1e-3 * step, 0.3);
    scene.advance(says, 0.02, pose, 5);
    scene.advance(says_nothing, 0.02, pose);
    for (SurfaceCells* cells : {&says, &says_nothing})
      cells->build(scene.particles, scene.speeds, 0.5, kStep, kCell, kReach, {});
    ASSERT_EQ(says.triangles().size(), says_nothing.triangles().size());
    ASSERT_GT(says.triangles().size(), 100u);
    for (std::size_t n = 0; n < says.triangles().size(); ++n)
      for (std::size_t i = 0; i < 7; ++i)
        EXPECT_LT(
            (says.triangles()[n].normals[i].xyz() - says_nothing.triangles()[n].normals[i].xyz())
                .norm(),
            1e-5f);
  }
}

TEST(SurfaceCells, OfSeveralSurfacesEachGoesOnFromWhereItWas) {
  const Scene scene;
  std::vector<Vec3f> corners;
  for (const Vec3& at : scene.shape.vertices) corners.push_back((0.01 * at).cast<float>());
  const Eigen::AlignedBox3f all(Vec3f::Constant(-10.0f), Vec3f::Constant(10.0f));
  for (std::size_t moving = 0; moving < 5; ++moving) {
    SurfaceCells cells;
    for (const double moved : {0.0, 3e-3}) {
      std::vector<SmokeSurface> surfaces;
      for (std::size_t s = 0; s < 5; ++s)
        surfaces.push_back({10 - s, &scene.topology, corners,
                            Pose{Vec3(s == moving ? moved : 0.0, 0.1 * static_cast<double>(s), 0)},
                            1});
      cells.advance(surfaces, Vec3::Zero());
      EXPECT_NEAR(cells.greatest_way(all), moved, 1e-7) << moving;
    }
  }
}

TEST(SurfaceCells, ThreadsChangeNothing) {
  Scene scene;
  std::array<SurfaceCells, 2> cells;
  for (std::size_t i = 0; i < 2; ++i) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            i == 0 ? 1 : 4);
    scene.advance(cells[i], 0.019, scene.pose(0.0, 0.3));
    scene.advance(cells[i], 0.020, scene.pose(1e-3, 0.3));
    cells[i].build(scene.particles, scene.speeds, 0.5, kStep, kCell, kReach, {});
  }
  EXPECT_TRUE(std::ranges::equal(cells[0].entries(), cells[1].entries()));
  EXPECT_TRUE(std::ranges::equal(cells[0].cell_begin(), cells[1].cell_begin()));
  ASSERT_EQ(cells[0].triangles().size(), cells[1].triangles().size());
  for (std::size_t n = 0; n < cells[0].triangles().size(); ++n)
    EXPECT_EQ(first_corners(cells[0].triangles()[n]), first_corners(cells[1].triangles()[n]));
}

}  // namespace
}  // namespace viscera
