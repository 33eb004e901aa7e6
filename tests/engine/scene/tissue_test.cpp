#include <gtest/gtest.h>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(Tissues, TheProjectsFileLoads) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  for (const char* name :
       {"liver", "gallbladder", "stomach", "abdominal_wall", "kidney", "lung", "spleen", "fat",
        "colon", "small_bowel", "diaphragm", "peritoneum", "ligament", "bile_duct", "rubber"})
    EXPECT_TRUE(tissues->contains(name)) << name;
}

TEST(Tissues, ModuliFollowFromWhatWasMeasured) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  const Tissue& liver = tissues->at("liver");
  EXPECT_EQ(liver.name, "liver");
  EXPECT_DOUBLE_EQ(liver.elastic.shear_modulus(), 1800.0);
  EXPECT_DOUBLE_EQ(liver.elastic.youngs_modulus, 2 * 1800.0 * 1.45);
  EXPECT_EQ(liver.density, 1060.0);
  EXPECT_DOUBLE_EQ(tissues->at("rubber").elastic.youngs_modulus, 10000.0);
  EXPECT_DOUBLE_EQ(tissues->at("rubber").elastic.poisson_ratio, 0.45);
  EXPECT_DOUBLE_EQ(tissues->at("lung").elastic.poisson_ratio, 0.43);
}

TEST(Tissues, ThermalValuesArriveInSiUnits) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  const auto& liver = tissues->at("liver").thermal;
  ASSERT_TRUE(liver);
  EXPECT_EQ(liver->density, 1060.0);
  EXPECT_EQ(liver->specific_heat, 3540.0);
  EXPECT_EQ(liver->conductivity, 0.52);
  EXPECT_NEAR(liver->perfusion, 860e-6 / 60.0 * 1060.0, 1e-9) << "mL/(min kg) -> 1/s";
  EXPECT_EQ(liver->water_fraction, 0.72);
  EXPECT_EQ(liver->electric_conductivity, 0.148);
  EXPECT_EQ(liver->coagulation.frequency, 5.53e41);
  EXPECT_EQ(liver->coagulation.energy, 276800.0);
  EXPECT_EQ(liver->smoke_yield, 0.05);
  EXPECT_LT(tissues->at("fat").thermal->smoke_yield, tissues->at("kidney").thermal->smoke_yield);
}

TEST(Tissues, EveryTissueOfABodyCanBeHeated) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  for (const auto& [name, tissue] : *tissues)
    EXPECT_EQ(tissue.thermal.has_value(), name != "rubber") << name;
}

TEST(Tissues, WhatHeatLacksIsNamed) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/tissues.json"));
  file["tissues"]["liver"].erase("perfusion");
  file["tissues"]["liver"].erase("specific_heat");
  const auto tissues = load_tissues(folder.write("tissues.json", file.dump()));
  ASSERT_TRUE(tissues) << tissues.error().text();
  EXPECT_FALSE(tissues->at("liver").thermal);
  EXPECT_EQ(tissues->at("liver").thermal_lacks,
            (std::vector<std::string>{"specific_heat", "perfusion"}));
  EXPECT_TRUE(tissues->at("spleen").thermal_lacks.empty());
}

TEST(Tissues, ThermalValuesThatCannotBeTogetherAreRefused) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/tissues.json"));
  file["tissues"]["liver"]["specific_heat"]["value"] = 2000;  // less than its water alone has
  const auto tissues = load_tissues(folder.write("tissues.json", file.dump()));
  ASSERT_FALSE(tissues);
  EXPECT_NE(tissues.error().text().find("tissues/liver: specific_heat"), std::string::npos)
      << tissues.error().text();
}

TEST(Tissues, AnOrganRelaxesByItsTissuesSeriesOnlyWhereThereIsOne) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  const auto& liver = tissues->at("liver").prony;
  ASSERT_EQ(liver.size(), 2u);
  EXPECT_EQ(liver[1].g, 0.2);
  EXPECT_EQ(liver[1].tau, 51.3);
  SceneDescription scene;
  scene.file = "some.json";
  scene.organs.resize(2);
  scene.organs[0].tissue = "liver";
  scene.organs[1].tissue = "kidney";
  scene.organs[0].material.relaxes = true;
  EXPECT_TRUE(check_materials(scene, *tissues));
  scene.organs[1].material.relaxes = true;
  const auto refused = check_materials(scene, *tissues);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text(),
            "some.json: organs/1/material/relaxes: found true with the tissue \"kidney\", which "
            "has no Prony "
            "series; expected one that has (liver), or a \"prony\" of its own");
}

TEST(Tissues, LooksArriveInMetres) {
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  for (const auto& [name, tissue] : *tissues) {
    EXPECT_GT(tissue.look.mottle_scale, 1e-4) << name;
    EXPECT_LT(tissue.look.mottle_scale, 0.1) << name;
    EXPECT_LT(tissue.look.bump_height, 1e-3) << name;
  }
  EXPECT_EQ(tissues->at("liver").look.pattern, TissueLook::Pattern::kCapsule);
  EXPECT_EQ(tissues->at("fat").look.pattern, TissueLook::Pattern::kLobules);
  EXPECT_EQ(tissues->at("diaphragm").look.pattern, TissueLook::Pattern::kFibres);
}

TEST(Tissues, ColoursOfEitherSpaceArriveLinear) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/tissues.json"));
  Json& look = file["tissues"]["liver"]["look"];
  look["colour"] = {0.5, 0.04, 1.0};
  look["colour_space"] = "srgb";
  auto tissues = load_tissues(folder.write("tissues.json", file.dump()));
  ASSERT_TRUE(tissues) << tissues.error().text();
  EXPECT_TRUE(tissues->at("liver").look.colour.isApprox(Vec3(0.2140411, 0.04 / 12.92, 1.0), 1e-6));
  look["colour_space"] = "linear";
  tissues = load_tissues(folder.write("tissues.json", file.dump()));
  ASSERT_TRUE(tissues) << tissues.error().text();
  EXPECT_EQ(tissues->at("liver").look.colour, Vec3(0.5, 0.04, 1.0));
}

TEST(Tissues, MistakesInALookAreNamed) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/tissues.json"));
  Json& look = file["tissues"]["liver"]["look"];
  look["pattern"] = "lobule";
  look["colour_space"] = "sRGB";
  look["roughness"] = 1.5;
  look["wettness"] = 0.5;
  look.erase("vein_colour");
  const auto tissues = load_tissues(folder.write("tissues.json", file.dump()));
  ASSERT_FALSE(tissues);
  const std::string text = tissues.error().text();
  EXPECT_EQ(tissues.error().messages.size(), 5u) << text;
  for (const char* part :
       {"tissues/liver/look/pattern: found the text \"lobule\"", "\"lobules\"",
        "tissues/liver/look/colour_space: found the text \"sRGB\", expected \"linear\" or \"srgb\"",
        "tissues/liver/look/roughness: found 1.5", "(did you mean \"wetness\"?)",
        "tissues/liver/look/vein_colour: found nothing"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST(Tissues, EveryMistakeIsReported) {
  const SceneFolder folder;
  Json file = *read_json(project_file("assets/tissues.json"));
  Json& liver = file["tissues"]["liver"];
  liver["shear_modulus"]["unit"] = "kPa";
  liver["density"].erase("source");
  liver["poisson_ratio"]["value"] = 0.5;
  liver["poisson_ratio"]["mark"] = "X";
  liver["look"]["colour"] = {0.1, 0.2, 1.5};
  liver["densty"] = 3;
  Json& kidney = file["tissues"]["kidney"];
  kidney["youngs_modulus"] = kidney["shear_modulus"];
  file["tissues"]["Big Toe"] = file["tissues"]["fat"];
  const auto tissues = load_tissues(folder.write("tissues.json", file.dump()));
  ASSERT_FALSE(tissues);
  const std::string text = tissues.error().text();
  EXPECT_EQ(tissues.error().messages.size(), 8u) << text;
  for (const char* part :
       {"tissues/liver/shear_modulus/unit: found the text \"kPa\", expected \"Pa\"",
        "tissues/liver/density/source: found nothing",
        "tissues/liver/poisson_ratio/value: found 0.5, expected a number from 0 to 0.4999",
        "tissues/liver/poisson_ratio/mark: found the text \"X\", expected \"V\", \"A\", \"R\" or "
        "\"E\"",
        "tissues/liver/look/colour: found [0.1,0.2,1.5]", "(did you mean \"density\"?)",
        "tissues/kidney: found youngs_modulus and shear_modulus, expected exactly one of",
        "tissues/Big Toe: found this key, expected a name"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST(Tissues, AnAbsentFileIsNamedByTheSceneThatNeedsIt) {
  SceneFolder folder;
  std::filesystem::remove(folder.path() / "assets/tissues.json");
  const Result<SceneDescription> scene = folder.load(least_scene());
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().text().find("tissues.json: found no such file"), std::string::npos);
}

}  // namespace
}  // namespace viscera::test
