// Where the springs of a link end.
#include "engine/features/links/link_places.h"

#include <gtest/gtest.h>

#include "engine/organ/shape.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;
constexpr double kGap = 1e-3;

/// Two balls beside each other along x, with a link around the place where they are nearest.
class TwoBalls : public ::testing::Test {
 protected:
  void SetUp() override {
    scene = soft_ball_scene(8e-3, 5e-3);
    scene.organs.push_back(scene.organs[0]);
    scene.organs[0].name = "one";
    scene.organs[1].name = "other";
    scene.organs[1].pose.position.x() = 2.0 * kRadius + kGap;
    Region region;
    region.shape = Region::Shape::kSphere;
    region.a = Vec3(kRadius + 0.5 * kGap, 0.0, 0.0);
    region.radius = 8e-3;
    scene.extras.set(LinkDescriptions{{"bed", {"one", "other"}, region, 100.0}});
    for (std::size_t o = 0; o < 2; ++o) {
      std::vector<std::string> notes;
      auto surface = build_shape(scene.organs[o].geometry, project_file("assets"), notes);
      ASSERT_TRUE(surface);
      surfaces[o] = std::move(*surface);
    }
  }
  Result<LinkPlaces> place() {
    const std::array<const TriangleSurface*, 2> all{&surfaces[0], &surfaces[1]};
    return place_springs(scene, 0, all);
  }
  SceneDescription scene;
  std::array<TriangleSurface, 2> surfaces;
};

TEST_F(TwoBalls, SpringsEndOnBothSurfacesInsideTheRegionApartFromEachOther) {
  const auto places = place();
  ASSERT_TRUE(places);
  ASSERT_EQ(places->springs.size(), kMostSprings);
  for (const LinkPlaces::Spring& spring : places->springs) {
    for (std::size_t end = 0; end < 2; ++end) {
      EXPECT_TRUE(links_of(scene)[0].region.contains(spring.positions[end]));
      const Vec3 out = spring.positions[end] - scene.organs[end].pose.position;
      EXPECT_NEAR(out.norm(), kRadius, 0.2e-3);
      EXPECT_GT(out.normalized().dot(spring.normals[end]), 0.99);
    }
    EXPECT_LT(spring.normals[0].dot(spring.normals[1]), 0.0);
    for (const LinkPlaces::Spring& other : places->springs) {
      if (&other == &spring) continue;
      for (std::size_t end = 0; end < 2; ++end)
        EXPECT_GT((other.positions[end] - spring.positions[end]).norm(), 2e-3);
    }
  }
  // A cap of a ball: 2 pi R h, cut by a sphere that reaches a little beyond 7 mm along it.
  EXPECT_NEAR(places->areas[0], places->areas[1], 0.05 * places->areas[0]);
  EXPECT_NEAR(places->areas[0], 3.14 * 64e-6, 0.1 * 3.14 * 64e-6);
}

TEST_F(TwoBalls, TheGroundTakesThePlacesOfTheOrgan) {
  scene.extras.get<LinkDescriptions>()[0].between = {"one", "ground"};
  const auto places = place();
  ASSERT_TRUE(places);
  EXPECT_EQ(places->springs.size(), kMostSprings);
  for (const LinkPlaces::Spring& spring : places->springs)
    EXPECT_EQ(spring.positions[0], spring.positions[1]);
}

TEST_F(TwoBalls, ARegionWithoutSurfaceIsRefusedWithTheNearestPlace) {
  scene.extras.get<LinkDescriptions>()[0].region.a = Vec3(0, 0, 60e-3);
  const auto places = place();
  ASSERT_FALSE(places);
  ASSERT_EQ(places.error().messages.size(), 2u);
  for (std::size_t o = 0; o < 2; ++o) {
    const std::string& message = places.error().messages[o];
    EXPECT_NE(message.find("links/0/region: found a ball of 8 mm about [0, 0, 60] mm without any "
                           "surface of organ \"" +
                           scene.organs[o].name + "\", expected some"),
              std::string::npos)
        << message;
  }
  EXPECT_NE(places.error().messages[0].find("nearest vertex is at [0.0, 0.0, 25.0] mm"),
            std::string::npos)
      << places.error().messages[0];
}

TEST_F(TwoBalls, ARegionSmallerThanATriangleStillHoldsSurface) {
  scene.extras.get<LinkDescriptions>()[0].region.radius = 0.8e-3;
  const auto places = place();
  ASSERT_TRUE(places);
  EXPECT_GE(places->springs.size(), 1u);
}

}  // namespace
}  // namespace viscera::test
