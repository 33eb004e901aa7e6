#include "engine/organ/wrap.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "engine/io/foreign_files.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

void append(TriangleSurface& surface, const TriangleSurface& other, const Vec3& by = Vec3::Zero()) {
  const int offset = static_cast<int>(surface.vertices.size());
  for (const Vec3& x : other.vertices) surface.vertices.push_back(x + by);
  for (const auto& [a, b, c] : other.triangles) {
    surface.triangles.push_back({a + offset, b + offset, c + offset});
  }
}

void turn_over(TriangleSurface& surface) {
  for (auto& triangle : surface.triangles) std::swap(triangle[0], triangle[1]);
}

// A ball without the part beyond `height` along z.
TriangleSurface opened_ball(double radius, double height) {
  TriangleSurface ball = icosphere(radius, 5);
  std::erase_if(ball.triangles, [&](const std::array<int, 3>& t) {
    return (ball.vertices[t[0]] + ball.vertices[t[1]] + ball.vertices[t[2]]).z() > 3.0 * height;
  });
  return ball;
}

Wrap wrap_ok(const TriangleSurface& surface, double voxel, double close = 0.0) {
  auto wrap = wrap_surface(surface, {voxel, close, 0.0});
  EXPECT_TRUE(wrap) << wrap.error().text();
  if (!wrap) return {};
  EXPECT_TRUE(surface_defects(wrap->surface).empty());
  return *wrap;
}

std::string notes_text(const Wrap& wrap, double voxel) {
  std::string text;
  for (const std::string& note : wrap_notes(wrap, {voxel, 0.0, 0.0})) text += note + "\n";
  return text;
}

constexpr double kVoxel = 1.5e-3;

TEST(Wrap, OfAClosedSurfaceLiesOnIt) {
  const TriangleSurface ball = icosphere(0.03, 4);
  const Wrap wrap = wrap_ok(ball, kVoxel);
  EXPECT_LT(wrap.mean_distance, 0.1 * kVoxel);
  EXPECT_LT(wrap.greatest_distance, 0.5 * kVoxel);
  EXPECT_NEAR(volume(wrap.surface) / volume(ball), 1.0, 0.015);
  EXPECT_TRUE(wrap.holes.empty());
  EXPECT_FALSE(wrap.filled);
  EXPECT_EQ(wrap.lost_share, 0.0);
  EXPECT_NE(notes_text(wrap, kVoxel).find("distance from the original at most"), std::string::npos);
}

TEST(Wrap, OfBodiesThatCrossIsTheirUnion) {
  TriangleSurface crossing = box({0.06, 0.02, 0.02}, 4);
  append(crossing, box({0.02, 0.06, 0.02}, 4));
  const Wrap wrap = wrap_ok(crossing, kVoxel);
  EXPECT_NEAR(volume(wrap.surface), (2 * 0.06 * 0.02 - 0.02 * 0.02) * 0.02, 0.03 * 0.04e-3);
}

TEST(Wrap, ForgetsWhatLiesInside) {
  // A thick wall around a hollow, with a stone in it: solid from outside.
  TriangleSurface shell = icosphere(0.03, 4), inner = icosphere(0.025, 4);
  turn_over(inner);
  append(shell, inner);
  append(shell, icosphere(0.01, 3), Vec3(0.003, 0, 0));
  const Wrap wrap = wrap_ok(shell, kVoxel);
  EXPECT_NEAR(volume(wrap.surface) / volume(icosphere(0.03, 4)), 1.0, 0.015);
}

TEST(Wrap, PatchesThatDoNotMeetAndTurnAnyWayAreJoined) {
  // Each triangle on its own, a little smaller than it was, every other one turned over.
  const TriangleSurface ball = icosphere(0.03, 3);
  TriangleSurface patches;
  for (std::size_t t = 0; t < ball.triangles.size(); ++t) {
    const auto& [a, b, c] = ball.triangles[t];
    const std::array<Vec3, 3> x = {ball.vertices[a], ball.vertices[b], ball.vertices[c]};
    const Vec3 middle = (x[0] + x[1] + x[2]) / 3.0;
    const int first = static_cast<int>(patches.vertices.size());
    for (const Vec3& corner : x) patches.vertices.push_back(middle + 0.9 * (corner - middle));
    patches.triangles.push_back({first, first + 1 + int(t % 2), first + 2 - int(t % 2)});
  }
  const Wrap wrap = wrap_ok(patches, kVoxel);
  EXPECT_FALSE(wrap.filled);
  EXPECT_NEAR(volume(wrap.surface) / volume(ball), 1.0, 0.015);
}

TEST(Wrap, NonManifoldWallsInsideDoNotMatter) {
  TriangleSurface cells = cube(0.04, 4);
  // A wall through the middle, whose edges lie on the cube's faces.
  const int v = static_cast<int>(cells.vertices.size());
  for (const auto& [x, y] : {std::pair{-0.02, -0.02}, {0.02, -0.02}, {0.02, 0.02}, {-0.02, 0.02}}) {
    cells.vertices.emplace_back(x, y, 0.0);
  }
  cells.triangles.push_back({v, v + 1, v + 2});
  cells.triangles.push_back({v, v + 2, v + 3});
  EXPECT_NEAR(volume(wrap_ok(cells, kVoxel).surface) / std::pow(0.04, 3), 1.0, 0.02);
}

TEST(Wrap, WideHolesAreFilledAndNamedWithTheirPlace) {
  // Half a ball: its mouth of 60 mm is forty voxels wide.
  const Wrap wrap = wrap_ok(opened_ball(0.03, 0.0), kVoxel);
  EXPECT_TRUE(wrap.filled);
  // The flat lid lies where half of all directions meet the bowl.
  EXPECT_NEAR(volume(wrap.surface) / (2.0 / 3.0 * std::numbers::pi * std::pow(0.03, 3)), 1.0, 0.06);
  ASSERT_EQ(wrap.holes.size(), 1u);
  EXPECT_NEAR(wrap.holes[0].width, 0.06, 0.008);
  EXPECT_LT(wrap.holes[0].place.head<2>().norm(), 6e-3);
  const std::string text = notes_text(wrap, kVoxel);
  EXPECT_NE(text.find("closed a gap about "), std::string::npos) << text;
  EXPECT_NE(text.find("more than ten voxels"), std::string::npos) << text;
  EXPECT_NE(text.find("the surface is open"), std::string::npos) << text;
}

TEST(Wrap, SurfacesThatTurnInwardsAreFilledAsWell) {
  TriangleSurface bowl = opened_ball(0.03, 0.01);
  turn_over(bowl);
  const Wrap wrap = wrap_ok(bowl, kVoxel);
  EXPECT_TRUE(wrap.filled);
  EXPECT_GT(volume(wrap.surface), 0.7 * volume(icosphere(0.03, 4)));
}

TEST(Wrap, NarrowHolesAreClosedWithoutAWarning) {
  // 6 mm wide: four voxels, and within close_mm.
  const double height = std::sqrt(0.03 * 0.03 - 0.003 * 0.003);
  const Wrap wrap = wrap_ok(opened_ball(0.03, height), kVoxel, 9e-3);
  EXPECT_FALSE(wrap.filled);
  EXPECT_TRUE(wrap.holes.empty());
  EXPECT_GT(wrap.greatest_distance, 1.5e-3);
  EXPECT_NEAR(volume(wrap.surface) / volume(icosphere(0.03, 5)), 1.0, 0.02);
}

TEST(Wrap, SheetsAreLostAndThatIsSaid) {
  TriangleSurface finned = icosphere(0.03, 4);
  // Small triangles, so that their middles sample the sheet.
  for (int i = 0; i < 20; ++i) {
    const double a = 0.03 + 0.00075 * i;
    const int w = static_cast<int>(finned.vertices.size());
    finned.vertices.emplace_back(a, -0.01, 0.0);
    finned.vertices.emplace_back(a + 0.00075, -0.01, 0.0);
    finned.vertices.emplace_back(a + 0.00075, 0.01, 0.0);
    finned.triangles.push_back({w, w + 1, w + 2});
  }
  const Wrap wrap = wrap_ok(finned, kVoxel);
  EXPECT_NEAR(volume(wrap.surface) / volume(icosphere(0.03, 4)), 1.0, 0.02);
  EXPECT_GT(wrap.lost_share, 0.0);
  EXPECT_NEAR(wrap.greatest_lost, 0.0145, 2e-3);
  EXPECT_NE(notes_text(wrap, kVoxel).find("wrapping lost "), std::string::npos);
}

TEST(Wrap, FlatSheetsAndSeparateBodiesAreRefused) {
  TriangleSurface sheet;
  sheet.vertices = {{0, 0, 0}, {0.05, 0, 0}, {0.05, 0.05, 0.001}, {0, 0.05, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_FALSE(wrap_surface(sheet, {kVoxel, 0.0, 0.0}));

  TriangleSurface two = icosphere(0.02, 3);
  append(two, icosphere(0.02, 3), Vec3(0.06, 0, 0));
  const auto refused = wrap_surface(two, {kVoxel, 0.0, 0.0});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("found a second piece"), std::string::npos)
      << refused.error().text();
}

TEST(Wrap, VoxelsThatDoNotFitTheBodyAreRefused) {
  const TriangleSurface ball = icosphere(0.03, 3);
  for (const double voxel : {0.0, -1e-3, 0.02, 1e-6}) {
    EXPECT_FALSE(wrap_surface(ball, {voxel, 0.0, 0.0})) << voxel;
  }
  EXPECT_FALSE(wrap_surface(TriangleSurface{}, {kVoxel, 0.0, 0.0}));
}

TEST(Wrap, DoesNotDependOnTheNumberOfThreads) {
  const TriangleSurface bowl = opened_ball(0.03, 0.0);
  const auto vertices = [&bowl](int threads) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    return wrap_ok(bowl, kVoxel).surface.vertices;
  };
  EXPECT_EQ(vertices(1), vertices(3));
}

TEST(Wrap, TheVisibleHumansRawOrgansBecomeSolidWithinAVoxel) {
  struct Organ {
    const char* raw;
    double voxel;
    const char* closed;  // the same organ as the data folder's authors closed it
  };
  for (const Organ& organ : {Organ{"VH_M_Gallbladder.glb", 1e-3, "gallbladder_800.obj"},
                             Organ{"VH_M_Kidney_L.glb", 2e-3, "kidney_left_1080.obj"}}) {
    const auto raw = shared_data(std::string("visible_human/") + organ.raw);
    const auto closed = shared_data(std::string("visible_human/") + organ.closed);
    if (!raw || !closed) GTEST_SKIP() << organ.raw << " is absent";
    const auto original = import_surface(*raw, 1.0), reference = import_surface(*closed, 1e-3);
    ASSERT_TRUE(original);
    ASSERT_TRUE(reference);
    const Wrap wrap = wrap_ok(*original, organ.voxel);
    EXPECT_LT(wrap.mean_distance, 0.1 * organ.voxel) << organ.raw;
    EXPECT_LT(wrap.greatest_distance, 1.5 * organ.voxel) << organ.raw;
    EXPECT_NEAR(volume(wrap.surface) / volume(*reference), 1.0, 0.06) << organ.raw;
  }
}

}  // namespace
}  // namespace viscera::test
