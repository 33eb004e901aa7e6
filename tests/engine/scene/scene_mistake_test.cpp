// Bad scene files: each mistake with its place, what was found, what was expected.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/scene/scene_keys.h"
#include "engine/scene/validate.h"
#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(SceneMistake, UnknownKeysNameTheNearestKnownOne) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/formulaton", "galerkin"), "organs/0/formulaton",
                     "found an unknown key", "did you mean \"formulation\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/wind", 3), "wind", "found an unknown key, expected one of",
                     "camera");
  Json scene = whole_scene();
  scene["organs"][0]["geometry"] = {{"recipy", "liver"}, {"seed", 2}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry/recipy",
                     "did you mean \"recipe\"");
}

TEST(SceneMistake, AWrongUnitSaysWhichIsExpected) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/youngs_modulus_Pa", 6000),
                     "organs/0/youngs_modulus_Pa", "found the unit Pa, expected the unit kPa",
                     "\"youngs_modulus_kPa\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/duration", 3), "duration",
                     "found no unit, expected the unit s");
  EXPECT_ONE_MISTAKE(mistakes_with("/light/intensity_W", 3), "light/intensity_W",
                     "found the unit W, expected no unit");
  Json scene = whole_scene();
  scene["organs"][1]["geometry"].erase("radius_mm");
  scene["organs"][1]["geometry"]["radius_cm"] = 2.5;
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/1/geometry/radius_cm",
                     "found the unit cm, expected the unit mm (did you mean \"radius_mm\"?)");
}

TEST(SceneMistake, StepsThatAFilmHasNoPicturesForAreRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/steps_per_s", 50), "steps_per_s", "found 50",
                     "expected 30, 60, 120 or 240");
}

TEST(SceneMistake, AMaterialThatIsNoneIsNamed) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/material/model", "mooney"), "organs/0/material/model",
                     "found the text \"mooney\"", "\"neo_hookean\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/material/prony/0/g", -0.2),
                     "organs/0/material/prony/0/g", "found -0.2");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/material/prony/0/tau_s", 0),
                     "organs/0/material/prony/0/tau_s", "found 0");
  EXPECT_ONE_MISTAKE(
      mistakes_with("/organs/0/material/prony",
                    Json::array({{{"g", 0.6}, {"tau_s", 1}}, {{"g", 0.5}, {"tau_s", 2}}})),
      "organs/0/material/prony", "found shares g of 1.1 together, expected at most 0.95");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/material/relaxes", true), "organs/0/material/prony",
                     "found beside \"relaxes\": true");
}

TEST(SceneMistake, WrongTypesAreNamed) {
  EXPECT_ONE_MISTAKE(mistakes_with("/duration_s", "4 s"), "duration_s",
                     "found the text \"4 s\", expected a number from 0.001 to 3600 [s]");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs", 3), "organs",
                     "found 3, expected an array of at most 200 objects");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/1", "liver"), "organs/1",
                     "found the text \"liver\", expected an object");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/deformable", 1), "organs/0/deformable",
                     "found 1, expected true or false");
  EXPECT_ONE_MISTAKE(mistakes_with("/seed", 1.5), "seed", "found 1.5, expected a whole number");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/pose/position_mm", {1, 2}),
                     "organs/0/pose/position_mm",
                     "found [1,2], expected an array of three numbers");
  EXPECT_ONE_MISTAKE(mistakes_with("/camera/round_mask", nullptr), "camera/round_mask",
                     "found null");
  const std::vector<std::string> root = SceneFolder().mistakes(Json::array({1}));
  ASSERT_EQ(root.size(), 1u);
  EXPECT_EQ(root[0], "found [1], expected an object");
}

TEST(SceneMistake, NegativeAndAbsurdValuesAreRefusedWithTheRange) {
  EXPECT_ONE_MISTAKE(mistakes_with("/duration_s", -1), "duration_s", "found -1",
                     "from 0.001 to 3600");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/1/geometry/radius_mm", -25),
                     "organs/1/geometry/radius_mm",
                     "found -25, expected a number from 0.1 to 1000 [mm]");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/youngs_modulus_kPa", 0),
                     "organs/0/youngs_modulus_kPa", "found 0", "from 0.001 to 1000000 [kPa]");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/poisson_ratio", 0.5), "organs/0/poisson_ratio",
                     "found 0.5", "from 0 to below 0.5");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/pose/position_mm/1", 1e30),
                     "organs/0/pose/position_mm", "from -10000 to 10000 [mm]");
  EXPECT_ONE_MISTAKE(mistakes_with("/seed", -1), "seed", "found -1", "a whole number from 0");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/1/path/0/power_W", 1e6),
                     "instruments/1/path/0/power_W", "from 0 to 400 [W]");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/resolution/spacing_mm", 1e-9),
                     "organs/0/resolution/spacing_mm", "found 1e-09", "from 0.1 to 100 [mm]");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/1/geometry/triangles", 501),
                     "organs/1/geometry/triangles", "found 501, expected an even number");
}

TEST(SceneMistake, NotANumberIsRefusedWithLineAndColumn) {
  const SceneFolder folder;
  const auto scene = folder.load_text("{\"version\": 1, \"name\": \"a\",\n \"duration_s\": NaN}");
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().text().find("scene.json:2:16: found \"NaN\", expected a finite number"),
            std::string::npos)
      << scene.error().text();
}

TEST(SceneMistake, AnotherVersionIsRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/version", 2), "version", "found 2, expected 1");
  EXPECT_ONE_MISTAKE(mistakes_with("/version", "1"), "version", "found the text \"1\", expected 1");
}

TEST(SceneMistake, MoreOrgansThanAreKeptAreRefusedBeforeAnyIsLookedAt) {
  Json organs = Json::array();
  for (int i = 0; i < 201; ++i) organs.push_back("no organ");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs", organs), "organs",
                     "found an array of 201, expected an array of at most 200 objects");
}

TEST(SceneMistake, MissingKeysAreNamed) {
  const std::vector<std::string> found = SceneFolder().mistakes(Json::object());
  EXPECT_EQ(found.size(), 3u) << all(found);
  EXPECT_TRUE(mentions(found, "version", {"found nothing, expected 1"}));
  EXPECT_TRUE(mentions(found, "name", {"found nothing, expected a name"}));
  EXPECT_TRUE(mentions(found, "organs", {"found nothing, expected an array of at most"}));
  Json scene = least_scene();
  scene["organs"][0].erase("tissue");
  EXPECT_ONE_MISTAKE(
      SceneFolder().mistakes(scene), "organs/0/tissue",
      "found nothing, expected the name of a tissue: one of abdominal_wall, bile_duct");
}

TEST(SceneMistake, ADeformableOrganNeedsAFixedRegion) {
  Json scene = least_scene();
  scene["organs"][0].erase("fixed");
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/fixed",
                     "found no region, expected at least one", "\"deformable\": false");
}

TEST(SceneMistake, RegionsAreExactlyOneShapeOfSomeExtent) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/fixed/0", Json::object()), "organs/0/fixed/0",
                     "found none of them, expected exactly one of half_space, sphere, box");
  EXPECT_ONE_MISTAKE(
      mistakes_with("/organs/0/fixed/1/box", {{"min_mm", {0, 0, 0}}, {"max_mm", {1, 1, 1}}}),
      "organs/0/fixed/1", "found sphere and box, expected exactly one of");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/fixed/2/box/max_mm", {-5, 2, 3}),
                     "organs/0/fixed/2/box/max_mm", "found [-5,2,3]", "above that of min_mm");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/fixed/0/half_space/normal", {0, 0, 0}),
                     "organs/0/fixed/0/half_space/normal", "found [0,0,0], expected a direction");
}

TEST(SceneMistake, TimesMustAscend) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/path/1/time_s", 0),
                     "instruments/0/path/1/time_s", "found 0 after 0, expected values that ascend");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/path", Json::array()), "instruments/0/path",
                     "found [], expected an array of 1 to 100000 objects");
}

TEST(SceneMistake, NamesAreUniqueAndPlain) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/1/name", "liver"), "organs/1/name",
                     "found the text \"liver\" again, expected another than that of organs/0");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/1/name", "holder"), "instruments/1/name", "again");
  for (const char* name : {"Left Kidney", "", "../up", "a/b", "Niere"})
    EXPECT_ONE_MISTAKE(mistakes_with("/organs/1/name", name), "organs/1/name",
                       "expected a name of a-z, 0-9 and _");
}

TEST(SceneMistake, UnknownNamesSayWhichAreKnown) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/tissue", "livr"), "organs/0/tissue",
                     "found the text \"livr\", expected the name of a tissue: one of",
                     "did you mean \"liver\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/geometry/recipe", "livver"),
                     "organs/0/geometry/recipe", "one of block, hemisphere, kidney, liver, sphere",
                     "did you mean \"liver\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/formulation", "galerkn"), "organs/0/formulation",
                     "did you mean \"galerkin\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/kind", "graspr"), "instruments/0/kind",
                     "expected \"probe\", \"grasper\", \"hook\", \"spatula\", \"scalpel\", "
                     "\"scissors\", \"clip_applier\" or \"bag\" (did you mean \"grasper\"?)");
}

TEST(SceneMistake, ANameThatThisBuildLeavesOutSaysWhy) {
  Json scene = least_scene();
  scene["organs"][0]["formulation"] = "gfdm";
  ReadContext context;
  context.vocabularies["formulation"] = {"galerkin"};
  context.left_out["formulation"]["gfdm"] = "it needs a library";
  const std::vector<Mistake> found = validate(scene, scene_keys(), context);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].path, "organs/0/formulation");
  EXPECT_NE(found[0].text.find("one of galerkin: it needs a library"), std::string::npos)
      << found[0].text;
}

TEST(SceneMistake, MissingGeometryListsTheFoldersSearched) {
  SceneFolder folder;
  folder.write("data/hearts/heart.stl", "solid\n");
  folder.options.search = {folder.path() / "data", folder.path() / "nowhere"};
  Json scene = whole_scene();
  scene["organs"][3]["geometry"]["file"] = "hart.stl";
  const std::string at = folder.path().string();
  EXPECT_ONE_MISTAKE(folder.mistakes(scene), "organs/3/geometry/file", "found no file \"hart.stl\"",
                     at + ", " + at + "/data, " + at + "/data/hearts, " + at +
                         "/nowhere (no such folder), " + at + "/assets",
                     "did you mean \"heart.stl\"");
}

TEST(SceneMistake, GeometryOfAnUnreadFormatOrAFolderIsRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/3/geometry/file", "ball.step"),
                     "organs/3/geometry/file",
                     "found the file \"ball.step\", expected one that ends in .obj, .stl");
  SceneFolder folder;
  std::filesystem::create_directory(folder.path() / "trap.obj");
  Json scene = whole_scene();
  scene["organs"][3]["geometry"]["file"] = "trap.obj";
  EXPECT_ONE_MISTAKE(folder.mistakes(scene), "organs/3/geometry/file", "no regular file");
}

TEST(SceneMistake, GeometryIsEitherARecipeOrAFile) {
  Json scene = whole_scene();
  scene["organs"][0]["geometry"] = {{"seed", 1}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry",
                     "found none of them, expected exactly one of recipe, file");
  scene["organs"][0]["geometry"] = {{"recipe", "liver"}, {"unit", "mm"}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry/unit",
                     "expected this key only beside file");
  scene["organs"][0]["geometry"] = {{"recipe", "liver"}, {"radius_mm", 3}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry/radius_mm",
                     "expected this key only where recipe is \"sphere\" or \"hemisphere\"");
  scene["organs"][0]["geometry"] = {{"recipe", "sphere"}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry/radius_mm", "found nothing");
  scene["organs"][0]["geometry"] = {{"file", "ball.obj"}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry/unit", "found nothing");
  scene["organs"][0]["geometry"] = {{"recipe", "liver"}, {"edge_mm", 3}, {"triangles", 500}};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "organs/0/geometry/triangles",
                     "found it beside edge_mm");
}

TEST(SceneMistake, ValuesThatDontFitTogetherAreRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/resolution/finest_spacing_mm", 11),
                     "organs/0/resolution/finest_spacing_mm", "at most spacing_mm, which is 10");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/trocar_mm", {0, 0, 90.5}),
                     "instruments/0/path/1/tip_mm", "at least 1 mm from trocar_mm");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/path/0/power_W", 30),
                     "instruments/0/path/0/power_W", "found 30 for a grasper, expected 0");
  EXPECT_ONE_MISTAKE(mistakes_with("/camera/path/0/target_mm", {0, -100, 50}),
                     "camera/path/0/target_mm", "at least 1 mm from tip_mm");
  EXPECT_ONE_MISTAKE(mistakes_with("/camera/optics_deg", 45), "camera/optics_deg",
                     "found 45, expected 0 or 30");
}

TEST(SceneMistake, AllAreReportedInOneGo) {
  Json scene = whole_scene();
  scene["duration_s"] = -1;
  scene["organs"][0]["tisue"] = "liver";
  scene["organs"][0]["geometry"]["recipe"] = "livr";
  scene["organs"][1]["geometry"]["radius_mm"] = "big";
  scene["organs"][3]["geometry"]["file"] = "absent.obj";
  scene["instruments"][0]["path"][1]["time_s"] = -3;
  scene["smoke"][0].erase("domain");
  scene["camera"]["path"] = 3;
  const std::vector<std::string> found = SceneFolder().mistakes(scene);
  for (const char* path :
       {"duration_s", "organs/0/tisue", "organs/0/geometry/recipe", "organs/1/geometry/radius_mm",
        "organs/3/geometry/file", "instruments/0/path/1/time_s", "smoke/0/domain", "camera/path"})
    EXPECT_TRUE(std::any_of(found.begin(), found.end(),
                            [path](const std::string& message) {
                              return message.starts_with(std::string(path) + ": ");
                            }))
        << path << "\n"
        << all(found);
}

TEST(SceneMistake, PartsSayOneShapeAndAModulusOrADensity) {
  const std::string parts = "organs/1/parts/0";
  const auto with = [](const Json& part) {
    return mistakes_with("/organs/1/parts", Json::array({part}));
  };
  EXPECT_TRUE(with({{"capsule_mm", 0.2}, {"youngs_modulus_kPa", 90}}).empty());
  EXPECT_TRUE(mentions(with({{"capsule_mm", 0.2}}), parts + "/youngs_modulus_kPa",
                       {"density_kg_m3", "expected at least one"}));
  EXPECT_TRUE(mentions(with({{"youngs_modulus_kPa", 90}}), parts, {"capsule_mm", "field"}));
  EXPECT_TRUE(mentions(
      with({{"field", {{"file", "map.nii"}, {"kPa_per_unit", 1}}}, {"youngs_modulus_kPa", 90}}),
      parts + "/youngs_modulus_kPa", {"beside field"}));
  EXPECT_TRUE(
      mentions(with({{"labels", {{"file", "ball.obj"}, {"label", 1}}}, {"youngs_modulus_kPa", 90}}),
               parts + "/labels/file", {"ends in", ".nii"}));
  EXPECT_TRUE(mentions(with({{"recipe", {{"name", "sphere"}}}, {"density_kg_m3", 900}}),
                       parts + "/recipe/name", {"sphere", "kidney"}));
}

TEST(SceneMistake, FibresNeedADirectionAModulusAndAResponseThatKnowsThem) {
  const auto with = [](const Json& fibres) {
    return mistakes_with("/organs/1/material", {{"fibres", fibres}});
  };
  EXPECT_TRUE(with({{"direction", {1, 0, 2}}, {"modulus_kPa", 20}}).empty());
  EXPECT_TRUE(mentions(with({{"direction", {0, 0, 0}}, {"modulus_kPa", 20}}),
                       "organs/1/material/fibres/direction", {"expected a direction"}));
  EXPECT_TRUE(mentions(with({{"direction", {1, 0, 0}}, {"modulus_kPa", -1}}),
                       "organs/1/material/fibres/modulus_kPa", {"-1"}));
  EXPECT_ONE_MISTAKE(with({{"modulus_kPa", 20}}), "organs/1/material/fibres/direction",
                     "found nothing");
}

TEST(SceneMistake, OnlyTheWeakFormTakesParts) {
  const Json parts = {{{"capsule_mm", 0.2}, {"youngs_modulus_kPa", 90}}};
  EXPECT_TRUE(mentions(mistakes_with("/organs/0/parts", parts), "organs/0/parts",
                       {"response local", "expected none"}));
  Json scene = whole_scene();
  scene["organs"][0]["parts"] = parts;
  scene["organs"][0]["response"] = "linear";
  scene["organs"][0]["formulation"] = "paper";
  EXPECT_TRUE(mentions(SceneFolder().mistakes(scene), "organs/0/parts", {"formulation paper"}));
}

}  // namespace
}  // namespace viscera::test
