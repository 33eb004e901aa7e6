#include "engine/organ/label_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/organ/label_field.h"
#include "kernels/points/surface_checks.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/label_files.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

constexpr double kPi = std::numbers::pi;

LabelMap map_of(const LabelImage& image) {
  const TemporaryFolder folder;
  write_bytes(folder / "map.nii", nifti_bytes(image));
  auto map = read_label_map(folder / "map.nii", {});
  EXPECT_TRUE(map) << map.error().text();
  return *map;
}

std::vector<LabelOrgan> organs_of(const LabelMap& map, const std::vector<std::int32_t>& labels) {
  std::vector<std::string> warnings;
  auto organs = label_surfaces(map, labels, {}, false, warnings);
  EXPECT_TRUE(organs) << organs.error().text();
  return organs ? *organs : std::vector<LabelOrgan>{};
}

std::function<bool(const Vec3&)> ball(const Vec3& centre, double radius) {
  return [=](const Vec3& x) { return (x - centre).norm() < radius; };
}

double farthest_from_sphere(const TriangleSurface& surface, const Vec3& centre, double radius) {
  double farthest = 0.0;
  for (const Vec3& x : surface.vertices) {
    farthest = std::max(farthest, std::abs((x - centre).norm() - radius));
  }
  return farthest;
}

TEST(LabelSurface, ABallHasTheLabelsVolumeAndIsRound) {
  LabelImage image = centred_image({26, 26, 26}, {3, 3, 3});
  image.fill(5, ball({1.0, 0.4, -0.7}, 30.0));
  const LabelMap map = map_of(image);
  const auto organs = organs_of(map, {5});
  ASSERT_EQ(organs.size(), 1u);
  const LabelOrgan& organ = organs.front();
  EXPECT_TRUE(surface_defects(organ.surface).empty());
  EXPECT_TRUE(organ.warnings.empty());
  EXPECT_NEAR(volume(organ.surface) / organ.label_volume, 1.0, 0.02);
  EXPECT_NEAR(organ.label_volume, 4.0 / 3.0 * kPi * std::pow(30e-3, 3), 0.02 * organ.label_volume);
  // Centres of voxels are inside or not: that leaves the surface unsure by half a voxel at worst.
  EXPECT_LT(farthest_from_sphere(organ.surface, Vec3(-1.0e-3, -0.7e-3, 0.4e-3), 30e-3), 1.5e-3);
}

TEST(LabelSurface, AnisotropicObliqueVoxelsMakeTheSameBall) {
  LabelImage image = centred_image({60, 60, 16}, {1.2, 1.2, 5.0});
  const Mat3 turn = Eigen::AngleAxisd(0.5, Vec3(1, -1, 2).normalized()).toRotationMatrix();
  image.axes = turn * image.axes;
  image.origin = turn * image.origin;
  image.fill(1, ball({0, 0, 0}, 30.0));
  const auto organs = organs_of(map_of(image), {1});
  ASSERT_EQ(organs.size(), 1u);
  EXPECT_NEAR(volume(organs[0].surface) / organs[0].label_volume, 1.0, 0.02);
  EXPECT_LT(farthest_from_sphere(organs[0].surface, Vec3::Zero(), 30e-3), 2.5e-3);
}

TEST(LabelSurface, SheetsAndRodsOfOneVoxelKeepTheirVolume) {
  LabelImage image = centred_image({34, 34, 14}, {3, 3, 3});
  image.fill(1, [](const Vec3& x) {
    return x.cwiseAbs().maxCoeff() < 40.0 && std::abs(x.z() - 1.5) < 1.0;
  });
  image.fill(2, [](const Vec3& x) {
    return std::abs(x.x()) < 40.0 && std::abs(x.y() - 1.5) < 1.0 && std::abs(x.z() + 10.5) < 1.0;
  });
  for (const LabelOrgan& organ : organs_of(map_of(image), {1, 2})) {
    EXPECT_TRUE(surface_defects(organ.surface).empty());
    EXPECT_NEAR(volume(organ.surface) / organ.label_volume, 1.0, 0.03) << organ.label;
  }
}

// A ball with a bite that another label fills, and a third around both.
LabelImage bitten_ball() {
  LabelImage image = centred_image({30, 30, 30}, {3, 3, 3});
  image.fill(3, ball({0, 0, 0}, 40.0));
  image.fill(1, ball({0, 0, 0}, 27.0));
  image.fill(2, ball({15, 0, 0}, 16.0));
  return image;
}

TEST(LabelSurface, SmoothedNeighboursDoNotOverlapWhateverTheirLevels) {
  const LabelMap map = map_of(bitten_ball());
  const auto extents = label_extents(map);
  for (const int smoothing : {-1, 0, 1, 2}) {
    std::vector<LabelField> fields;
    for (const int label : {1, 2}) {
      fields.emplace_back(map, label_pieces(map, label, extents.at(label)).front(), smoothing,
                          std::vector<std::int32_t>{1, 2});
      fields.back().set_level(fields.back().greatest_level());
    }
    double deepest = 0.0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 x = 40e-3 * Vec3(std::sin(1.1 * i), std::sin(1.7 * i + 1.0), std::sin(2.3 * i));
      deepest = std::max(deepest, -std::max(fields[0](x), fields[1](x)));
    }
    EXPECT_LT(deepest, 1e-8) << smoothing;
  }
}

TEST(LabelSurface, NeighboursOverlapOnlyByWhatFlatTrianglesCutOff) {
  const auto organs = organs_of(map_of(bitten_ball()), {1, 2});
  ASSERT_EQ(organs.size(), 2u);
  const SurfaceTree first(organs[0].surface);
  double deepest = 0.0;
  for (const Vec3& x : organs[1].surface.vertices) {
    deepest = std::max(deepest, -first.signed_distance(x));
  }
  // At the rim of the bite an edge, of at most 4/3 of the wanted length, bridges a right angle:
  // half of it times sin 45 deg.
  EXPECT_LT(deepest, 2.0 / 3.0 * std::sqrt(0.5) * organs[0].edge);
  for (const LabelOrgan& organ : organs) {
    EXPECT_NEAR(volume(organ.surface) / organ.label_volume, 1.0, 0.03);
  }
}

TEST(LabelSurface, PiecesBecomeOrgansAndCrumbsAreNamed) {
  LabelImage image = centred_image({40, 16, 16}, {3, 3, 3});
  image.fill(4, ball({-35, 0, 0}, 17.0));
  image.fill(4, ball({30, 0, 0}, 12.0));
  image.at(20, 1, 1) = 4;
  const auto organs = organs_of(map_of(image), {4});
  ASSERT_EQ(organs.size(), 2u);
  EXPECT_GT(organs[0].voxels, organs[1].voxels);
  EXPECT_EQ(organs[1].piece, 2);
  std::string told;
  for (const std::string& warning : organs[0].warnings) told += warning + "\n";
  EXPECT_NE(told.find("in 2 pieces"), std::string::npos) << told;
  EXPECT_NE(told.find("1 crumbs were left out"), std::string::npos) << told;
}

TEST(LabelSurface, CavitiesAreFilledAndBordersNoticed) {
  LabelImage image = centred_image({20, 20, 20}, {3, 3, 3});
  image.fill(1, [](const Vec3& x) { return x.x() < 0.0 && x.tail<2>().norm() < 25.0; });
  image.fill(0, ball({-15, 0, 0}, 7.0));
  const auto organs = organs_of(map_of(image), {1});
  ASSERT_EQ(organs.size(), 1u);
  std::string told;
  for (const std::string& warning : organs[0].warnings) told += warning + "\n";
  EXPECT_NE(told.find("a cavity was filled"), std::string::npos) << told;
  EXPECT_NE(told.find("reaches the border of the volume"), std::string::npos) << told;
  EXPECT_NEAR(volume(organs[0].surface) / organs[0].label_volume, 1.0, 0.03);
}

TEST(LabelSurface, AbsentAndTinyLabelsAreRefusedOrLeftOut) {
  LabelImage image = centred_image({20, 20, 20}, {3, 3, 3});
  image.fill(1, ball({0, 0, 0}, 20.0));
  image.at(1, 1, 1) = 2;
  const LabelMap map = map_of(image);
  std::vector<std::string> warnings;
  const auto refused = label_surfaces(map, {2, 7, 0}, {}, false, warnings);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("found no voxel of label 7, expected one of 1, 2"),
            std::string::npos);
  EXPECT_NE(refused.error().text().find("label 2: found at most 1 voxels in one piece"),
            std::string::npos);
  EXPECT_NE(refused.error().text().find("no voxel of label 0"), std::string::npos);
  const auto organs = label_surfaces(map, {1, 2}, {}, true, warnings);
  ASSERT_TRUE(organs);
  EXPECT_EQ(organs->size(), 1u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("left out"), std::string::npos);
}

}  // namespace
}  // namespace viscera::test
