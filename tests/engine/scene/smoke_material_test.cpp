#include "engine/scene/smoke_material.h"

#include <gtest/gtest.h>

#include "engine/scene/json_file.h"
#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(SmokeMaterial, TheProjectsFileLoadsAndIsWhatIsAssumedWithoutIt) {
  const auto optics = load_smoke_optics(project_file("assets/smoke.json"));
  ASSERT_TRUE(optics) << optics.error().text();
  EXPECT_EQ(optics->mass_extinction, SmokeOptics{}.mass_extinction);
  EXPECT_EQ(optics->albedo, SmokeOptics{}.albedo);
  EXPECT_EQ(optics->asymmetry, SmokeOptics{}.asymmetry);
}

TEST(SmokeMaterial, ValuesWithoutASourceOrInAnotherUnitAreRefused) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/smoke.json"));
  file["optics"]["mass_extinction"]["unit"] = "m2/g";
  file["optics"]["albedo"]["value"] = 1.5;
  file["optics"]["asymmetry"].erase("source");
  const auto optics = load_smoke_optics(folder.write("smoke.json", file.dump()));
  ASSERT_FALSE(optics);
  const std::string text = optics.error().text();
  EXPECT_EQ(optics.error().messages.size(), 3u) << text;
  for (const char* part :
       {"optics/mass_extinction/unit: found the text \"m2/g\"", "optics/albedo/value: found 1.5",
        "optics/asymmetry/source: found nothing"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

}  // namespace
}  // namespace viscera::test
