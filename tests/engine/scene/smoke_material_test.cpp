#include "engine/scene/smoke_material.h"

#include <gtest/gtest.h>

#include "engine/scene/json_file.h"
#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(SmokeMaterial, TheProjectsFileLoadsAndIsWhatIsAssumedWithoutIt) {
  const auto material = load_smoke_material(project_file("assets/smoke.json"));
  ASSERT_TRUE(material) << material.error().text();
  EXPECT_EQ(material->droplets.median, Droplets{}.median);
  EXPECT_EQ(material->droplets.deviation, Droplets{}.deviation);
  EXPECT_EQ(material->droplets.density, Droplets{}.density);
  EXPECT_EQ(material->droplets.refraction, Droplets{}.refraction);
  EXPECT_EQ(material->droplets.absorption, Droplets{}.absorption);
  EXPECT_EQ(material->jet_entrainment, SmokeParameters{}.jet_entrainment);
  EXPECT_EQ(material->eddies.share, SmokeEddies{}.share);
  EXPECT_EQ(material->eddies.wavelength, SmokeEddies{}.wavelength);
  EXPECT_EQ(material->eddies.period, SmokeEddies{}.period);
  EXPECT_EQ(material->eddies.white, SmokeEddies{}.white);
}

TEST(SmokeMaterial, OpticsAndSettlingFollowFromItsDroplets) {
  const auto material = load_smoke_material(project_file("assets/smoke.json"));
  ASSERT_TRUE(material) << material.error().text();
  const SmokeOptics optics = optics_of(material->droplets, material->wavelength);
  // Fresh smoke takes 3000 to 5000 m2/kg and more, scatters 0.8 to 0.95 of that.
  EXPECT_NEAR(optics.mass_extinction, SmokeOptics{}.mass_extinction, 10.0);
  EXPECT_NEAR(optics.albedo, SmokeOptics{}.albedo, 1e-3);
  EXPECT_NEAR(optics.asymmetry, SmokeOptics{}.asymmetry, 1e-3);
  EXPECT_NEAR(settling_speed(material->droplets, GasMixture()),
              SmokeParameters{}.deposition_velocity, 0.05e-5);
}

TEST(SmokeMaterial, ValuesWithoutASourceOrInAnotherUnitAreRefused) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/smoke.json"));
  file["droplets"]["median_diameter"]["unit"] = "um";
  file["droplets"]["refraction"]["value"] = 0.5;
  file["motion"]["eddy_share"].erase("source");
  file["motion"]["eddy_period"]["mark"] = "guessed";
  const auto material = load_smoke_material(folder.write("smoke.json", file.dump()));
  ASSERT_FALSE(material);
  const std::string text = material.error().text();
  EXPECT_EQ(material.error().messages.size(), 4u) << text;
  for (const char* part :
       {"droplets/median_diameter/unit: found the text \"um\"",
        "droplets/refraction/value: found 0.5", "motion/eddy_share/source: found nothing",
        "motion/eddy_period/mark: found the text \"guessed\""})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

}  // namespace
}  // namespace viscera::test
