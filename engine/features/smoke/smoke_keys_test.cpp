#include "engine/features/smoke/smoke_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(SmokeKeys, ArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  ASSERT_EQ(smoke_of(*scene).size(), 1u);
  const SmokeDescription& smoke = smoke_of(*scene)[0];
  EXPECT_EQ(smoke.domain.max(), Vec3(0.1, 0.1, 0.1));
  EXPECT_EQ(smoke.voxel, 0.001);
  EXPECT_EQ(smoke.max_particles, 1000);
  EXPECT_DOUBLE_EQ(smoke.particle_mass, 2e-10);
  EXPECT_DOUBLE_EQ(smoke.spacing, 0.002);
  EXPECT_EQ(smoke.laplacian, Laplacian::kPaper);
  EXPECT_EQ(smoke.lifetime, 5.0);
  EXPECT_EQ(smoke.look, SmokeLook::kSprites);
}

TEST(SmokeKeys, LeftOutAreAsInTheStructures) {
  Json text = least_scene();
  text["smoke"] =
      Json::parse(R"([{"name": "s", "domain": {"min_mm": [0, 0, 0], "max_mm": [9, 9, 9]}}])");
  const Result<SceneDescription> scene = SceneFolder().load(text);
  ASSERT_TRUE(scene) << scene.error().text();
  const SmokeDescription& smoke = smoke_of(*scene)[0];
  const SmokeDescription plain;
  EXPECT_DOUBLE_EQ(smoke.voxel, plain.voxel);
  EXPECT_EQ(smoke.max_particles, plain.max_particles);
  EXPECT_DOUBLE_EQ(smoke.particle_mass, plain.particle_mass);
  EXPECT_EQ(smoke.look, SmokeLook::kMarch);
}

TEST(SmokeKeys, EmittersAreHooksOrPlaces) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const std::vector<EmitterDescription>& emitters = smoke_of(*scene)[0].emitters;
  ASSERT_EQ(emitters.size(), 2u);
  EXPECT_EQ(emitters[0].instrument, "burner");
  const EmitterDescription& place = emitters[1];
  EXPECT_EQ(place.instrument, "");
  EXPECT_EQ(place.position, Vec3(0.05, 0.05, 0.01));
  EXPECT_EQ(place.direction, Vec3(0, 0, 1));
  EXPECT_DOUBLE_EQ(place.radius, 0.002);
  EXPECT_DOUBLE_EQ(place.rate, 3e-6);
  EXPECT_EQ(place.particles, 500.0);
  EXPECT_DOUBLE_EQ(place.speed, 0.2);
  EXPECT_EQ(place.excess, 40.0);
  EXPECT_FALSE(place.when.contains(0.999));
  EXPECT_TRUE(place.when.contains(1.0));
  EXPECT_FALSE(place.when.contains(2.0));
}

TEST(SmokeKeys, VolumesAreOfSomeExtentAndNotOfTooManyVoxels) {
  for (const char* key : {"spacing_mm", "voxel_mm"})
    for (const double length : {0.0, -2.0})
      EXPECT_ONE_MISTAKE(mistakes_with(std::string("/smoke/0/") + key, length),
                         std::string("smoke/0/") + key, "expected a number from");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/max_particles", 1e12), "smoke/0/max_particles",
                     "a whole number from 1 to 10000000");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/voxel_mm", 0.15), "smoke/0/voxel_mm",
                     "more than 512 x 512 x 512 voxels");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/domain/max_mm", {0, 100, 100}),
                     "smoke/0/domain/max_mm", "above that of min_mm");
}

TEST(SmokeKeys, SmokeComesFromHooksAndFromPlacesInItsDomain) {
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/emitters/0/instrument", "holder"),
                     "smoke/0/emitters/0/instrument", "which is a grasper, expected a hook");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/emitters/0/instrument", "burnr"),
                     "smoke/0/emitters/0/instrument", "burner");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/emitters/1/position_mm", {50, 50, 101}),
                     "smoke/0/emitters/1/position_mm", "expected a place inside the domain");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/emitters/1/to_s", 0.5), "smoke/0/emitters/1/to_s",
                     "found 0.5, expected at least from_s, which is 1");
  EXPECT_ONE_MISTAKE(mistakes_with("/smoke/0/emitters/1/direction", {0, 0, 0}),
                     "smoke/0/emitters/1/direction", "expected a direction");
}

}  // namespace
}  // namespace viscera::test
