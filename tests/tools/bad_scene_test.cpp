// Scene files and options that can't be: one clear message, exit code 2, nothing written.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "kernels/base/sanitized.h"
#include "tests/support/baselines.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// Runs and checks the folder's scene; expects that both refuse it with these words and that no
/// --out is made.
void expect_scene_refused(const SceneFolder& folder, std::vector<std::string> words,
                          const std::vector<std::string>& options = {}) {
  words.push_back("tiny.json: ");
  std::vector<std::string> run_options = options;
  run_options.push_back("--no-render");
  expect_refused(folder.run(run_options), words);
  EXPECT_FALSE(fs::exists(folder.out()));
  expect_refused(folder.check(options), words);
  EXPECT_FALSE(fs::exists(folder.cache()));
}

TEST(BadSceneFile, MissingIsNamed) {
  const SceneFolder folder;
  fs::remove(folder.scene());
  expect_scene_refused(folder, {"found no such file", "expected a JSON file"});
}

TEST(BadSceneFile, EmptyIsSaidToBeEmpty) {
  const SceneFolder folder;
  folder.write("");
  expect_scene_refused(folder, {"found an empty file", "expected a JSON object"});
}

TEST(BadSceneFile, TruncatedIsNamedByLineAndColumn) {
  const SceneFolder folder;
  const std::string text = tiny_scene().dump(2);
  folder.write(text.substr(0, text.size() / 2));
  const ProgramResult result = folder.run({"--no-render"});
  expect_refused(result, {"tiny.json:", "found", "expected"});
  EXPECT_FALSE(fs::exists(folder.out()));
}

TEST(BadSceneFile, BinaryIsSaidToBeBinary) {
  const SceneFolder folder;
  folder.write(
      std::string("\x7f"
                  "ELF\x02\x01\x01\0\0\0\xff\xfe\x80",
                  13));
  expect_scene_refused(folder, {"found binary data", "expected JSON text"});
}

TEST(BadSceneFile, AHeldToolWhoseTipHivesDoNotKnowIsRefusedBeforeAnythingIsPrepared) {
  Json scene = tiny_scene();
  scene["instruments"][1]["haptic"] = Json::object();
  scene["instruments"][1]["tip"] = {{"shape", "capsule"}, {"radius_mm", 2}, {"length_mm", 5}};
  const SceneFolder folder(scene);
  for (const ProgramResult& result : {run_program(folder.call({})), folder.check({})}) {
    expect_refused(result, {"instruments/1/tip/shape", "capsule", "expected sphere or point"});
    EXPECT_EQ(result.err.find("preparing"), std::string::npos) << result.told();
  }
}

TEST(BadSceneFile, EnormousIsRefusedUnread) {
  const SceneFolder folder;
  fs::resize_file(folder.scene(), 4ull << 30);  // sparse
  const ProgramResult result = folder.run({"--no-render"});
  expect_refused(result, {"tiny.json: found 4294967296 bytes", "expected at most"});
  EXPECT_LT(result.wall_s, 30.0);
}

TEST(BadSceneFile, EndlessNestingIsRefused) {
  const SceneFolder folder;
  folder.write(std::string(1 << 20, '['));
  expect_refused(folder.run({"--no-render"}), {"tiny.json"});
}

TEST(BadSceneFile, FolderIsRefused) {
  const SceneFolder folder;
  fs::remove(folder.scene());
  fs::create_directory(folder.scene());
  expect_scene_refused(folder, {"found a folder", "expected a JSON file"});
}

TEST(BadSceneFile, NanIsRefusedWhereItStands) {
  const SceneFolder folder;
  folder.write(R"({"version": 1, "name": "tiny", "duration_s": NaN, "organs": []})");
  expect_refused(folder.run({"--no-render"}), {"tiny.json:1:", "found", "expected"});
  folder.write(R"({"version": 1, "name": "tiny", "duration_s": 1e999, "organs": []})");
  expect_refused(folder.run({"--no-render"}), {"tiny.json:1:", "1e999"});
}

struct WrongValue {
  const char* name;
  const char* key;    ///< JSON pointer
  const char* value;  ///< JSON; "" takes the key away
  std::vector<std::string> words;
};

class BadSceneValue : public testing::TestWithParam<WrongValue> {};

TEST_P(BadSceneValue, IsRefusedWithItsKey) {
  const WrongValue& wrong = GetParam();
  Json scene = tiny_scene();
  const Json::json_pointer key(wrong.key);
  if (wrong.value[0] == '\0')
    scene.at(key.parent_pointer()).erase(key.back());
  else
    scene[key] = Json::parse(wrong.value);
  expect_scene_refused(SceneFolder(scene), wrong.words);
}

INSTANTIATE_TEST_SUITE_P(
    Scene, BadSceneValue,
    testing::Values(
        WrongValue{"UnknownKey",
                   "/durations_s",
                   "3",
                   {"durations_s: found an unknown key", "did you mean \"duration_s\"?"}},
        WrongValue{"UnknownKeyDeepInside",
                   "/organs/0/geometry/radus_mm",
                   "3",
                   {"organs/0/geometry/radus_mm: found an unknown key", "\"radius_mm\""}},
        WrongValue{"MissingKey", "/organs/0/tissue", "", {"organs/0/tissue", "expected"}},
        WrongValue{"WrongType",
                   "/duration_s",
                   "\"long\"",
                   {"duration_s: found the text \"long\", expected a number"}},
        WrongValue{"TextForAList", "/organs", "\"liver\"", {"organs: found", "expected an array"}},
        WrongValue{"TwoComponents",
                   "/organs/0/pose",
                   R"({"position_mm": [1, 2]})",
                   {"organs/0/pose/position_mm: found", "expected"}},
        WrongValue{"WrongUnit",
                   "/organs/0/geometry/radius_cm",
                   "2",
                   {"organs/0/geometry/radius_cm: found", "\"radius_mm\""}},
        WrongValue{"UnitWithinTheValue",
                   "/organs/0/geometry/radius_mm",
                   "\"25 mm\"",
                   {"organs/0/geometry/radius_mm: found the text \"25 mm\", expected a number"}},
        WrongValue{"NegativeRadius",
                   "/organs/0/geometry/radius_mm",
                   "-25",
                   {"organs/0/geometry/radius_mm: found -25, expected a number from"}},
        WrongValue{"NegativePower",
                   "/instruments/0/path/0/power_W",
                   "-3",
                   {"instruments/0/path/0/power_W: found -3, expected"}},
        WrongValue{"AbsurdDuration",
                   "/duration_s",
                   "1e12",
                   {"duration_s: found", "expected a number from 0.001 to 3600 [s]"}},
        WrongValue{"AbsurdPosition",
                   "/instruments/0/path/0/tip_mm",
                   "[1e30, 0, 0]",
                   {"instruments/0/path/0/tip_mm", "expected"}},
        WrongValue{"Incompressible",
                   "/organs/0/poisson_ratio",
                   "0.5",
                   {"organs/0/poisson_ratio: found 0.5, expected"}},
        WrongValue{"BackwardsInTime",
                   "/instruments/0/path/1/time_s",
                   "0",
                   {"instruments/0/path/1/time_s: found 0", "expected"}},
        WrongValue{"NegativeSeed", "/seed", "-1", {"seed: found -1, expected a whole number"}},
        WrongValue{"UnknownTissue",
                   "/organs/0/tissue",
                   "\"livr\"",
                   {"organs/0/tissue: found the text \"livr\"", "\"liver\""}},
        WrongValue{"UnknownRecipe",
                   "/organs/0/geometry",
                   R"({"recipe": "spleeen"})",
                   {"organs/0/geometry/recipe: found the text \"spleeen\""}},
        WrongValue{"NothingHoldsIt",
                   "/organs/0/fixed",
                   "[]",
                   {"organs/0/fixed: found no region, expected at least one"}},
        WrongValue{"TooManyVoxels",
                   "/smoke/0/domain",
                   R"({"min_mm": [-9000, -9000, -9000], "max_mm": [9000, 9000, 9000]})",
                   {"smoke/0/voxel_mm: found", "expected"}},
        WrongValue{"GravityWithoutDirection",
                   "/gravity",
                   R"({"rest_direction": [0, 0, 0]})",
                   {"gravity/rest_direction: found [0,0,0], expected a direction"}},
        WrongValue{"LinkToAnUnknownOrgan",
                   "/links",
                   R"([{"name": "bed", "between": ["ball", "livr"], "stiffness_N_per_m": 200,
                        "region": {"sphere": {"centre_mm": [0, 0, 25], "radius_mm": 8}}}])",
                   {"links/0/between/1: found the text \"livr\", expected"}},
        WrongValue{"LinkToItself",
                   "/links",
                   R"([{"name": "bed", "between": ["ball", "ball"], "stiffness_N_per_m": 200,
                        "region": {"sphere": {"centre_mm": [0, 0, 25], "radius_mm": 8}}}])",
                   {"links/0/between/1: found \"ball\" again"}},
        WrongValue{"LinkWithoutStiffness",
                   "/links",
                   R"([{"name": "bed", "between": ["ball", "ground"],
                        "region": {"sphere": {"centre_mm": [0, 0, 25], "radius_mm": 8}}}])",
                   {"links/0/stiffness_N_per_m: found nothing, expected a number"}},
        WrongValue{"LinkWithoutPlace",
                   "/links",
                   R"([{"name": "bed", "between": ["ball", "ground"], "stiffness_N_per_m": 200}])",
                   {"links/0/region: found nothing, expected an object"}},
        WrongValue{"FutureVersion", "/version", "2", {"version: found 2, expected 1"}}),
    [](const auto& wrong) { return std::string(wrong.param.name); });

TEST(BadSceneFile, AllMistakesComeInOneGo) {
  Json scene = tiny_scene();
  scene["duration_s"] = -1;
  scene["organs"][0]["tissue"] = "stone";
  scene["sed"] = 3;
  expect_scene_refused(SceneFolder(scene), {"duration_s: found -1", "organs/0/tissue: found",
                                            "sed: found an unknown key", "\"seed\""});
}

TEST(BadSceneFile, AnInstrumentThatStartsInsideAnOrganIsToldHowFarToMove) {
  Json scene = tiny_scene();
  scene["instruments"][0]["path"][0]["tip_mm"] = {0, 0, 10};
  const SceneFolder folder(scene);
  const std::vector<std::string> words = {"tiny.json: instruments/0/path/0/tip_mm: the tip starts",
                                          "mm inside organ \"ball\"",
                                          "expected a place outside every organ"};
  expect_refused(folder.check(), words);
  expect_refused(folder.run({"--no-render"}), words);
  EXPECT_TRUE(std::filesystem::is_empty(folder.out())) << "nothing is written";
}

TEST(BadSceneFile, ALinkWhoseRegionHoldsNoSurfaceIsToldWhereTheOrganIs) {
  Json scene = tiny_scene();
  scene["links"] = Json::parse(
      R"([{"name": "bed", "between": ["ball", "ground"], "stiffness_N_per_m": 200,
           "region": {"sphere": {"centre_mm": [0, 0, 90], "radius_mm": 8}}}])");
  const SceneFolder folder(scene);
  const std::vector<std::string> words = {
      "tiny.json: links/0/region: found a ball of 8 mm about [0, 0, 90] mm without any surface of "
      "organ \"ball\", expected some; the organ's nearest vertex is at"};
  expect_refused(folder.check(), words);
  expect_refused(folder.run({"--no-render"}), words);
  EXPECT_TRUE(fs::is_empty(folder.out())) << "nothing is written";
}

TEST(BadSceneFile, AbsurdlyFineNodesAreRefusedBeforeTheyArePlaced) {
  Json scene = tiny_scene();
  scene["organs"][0]["resolution"] = {{"spacing_mm", 0.1}, {"finest_spacing_mm", 0.1}};
  const ProgramResult result = SceneFolder(scene).run({"--no-render"});
  expect_refused(result, {"organs/0 (\"ball\")", "nodes expected", "coarser"});
  EXPECT_LT(result.wall_s, 30.0);
}

TEST(BadSceneFile, AModelBeyondTheMachinesMemoryIsRefusedBeforeItIsFactored) {
  const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (memory > 150e9) GTEST_SKIP() << "this machine could hold it";
  Json scene = tiny_scene();
  scene["organs"][0]["resolution"] = {
      {"spacing_mm", 7}, {"finest_spacing_mm", 0.1}, {"gradient", 0.1}};
  const SceneFolder folder(scene);
  expect_refused(folder.run({"--no-render"}),
                 {"organs/0 (\"ball\"): resolution: found spacings that make",
                  "GB, expected at most", "raise finest_spacing_mm"});
  EXPECT_TRUE(files_of(folder.out(), ".json").empty());
}

/// Refused by check before anything is prepared, and by run with the same words.
void expect_organ_refused(const Json& organ_keys, std::vector<std::string> words) {
  Json scene = tiny_scene();
  scene["organs"][0].update(organ_keys);
  const SceneFolder folder(scene);
  words.push_back("tiny.json: organs/0 (\"ball\"): ");
  expect_refused(folder.check(), words);
  EXPECT_TRUE(files_of(folder.cache(), ".h5").empty()) << "a check prepares nothing";
  expect_refused(folder.run({"--no-render"}), words);
  EXPECT_TRUE(fs::is_empty(folder.out())) << "nothing is written";
}

TEST(BadSceneFile, PublishedFormulationIsTakenOrSaysWhatWasExpected) {
  Json scene = tiny_scene();
  scene["organs"][0]["formulation"] = "paper";
  const SceneFolder folder(scene);
  if (strong_forms_built_in()) {
    const ProgramResult result = folder.check();
    EXPECT_EQ(result.code, 0) << result.told();
  } else {
    expect_scene_refused(
        folder, {"organs/0/formulation", "galerkin_quadratic",
                 "\"paper\" is one of the published formulations", "VISCERA_BASELINES=ON"});
  }
}

TEST(BadSceneFile, DifferencesOfNearlyIncompressibleTissueAreRefused) {
  if (!strong_forms_built_in()) GTEST_SKIP() << kNoStrongForms;
  expect_organ_refused({{"formulation", "gfdm"}, {"poisson_ratio", 0.48}},
                       {"formulation \"gfdm\": Poisson's ratio is 0.48; expected at most 0.45",
                        "use \"galerkin\", or a lower ratio"});
}

TEST(BadSceneFile, FixedRegionThatMissesTheOrganIsRefused) {
  const std::vector<std::string> words = {"fixed region: it holds no part of the surface",
                                          "expected a region that meets the surface"};
  for (const char* region : {R"({"half_space": {"point_mm": [0, 0, -80], "normal": [0, 0, 1]}})",
                             R"({"sphere": {"centre_mm": [0, 0, 0], "radius_mm": 3}})",
                             R"({"box": {"min_mm": [20, 20, 20], "max_mm": [30, 30, 30]}})"})
    expect_organ_refused({{"fixed", Json::array({Json::parse(region)})}}, words);
}

TEST(BadSceneFile, FixedRegionTooSmallToHoldAnythingIsRefusedByTheRun) {
  Json scene = tiny_scene();
  scene["organs"][0]["fixed"] = {
      Json::parse(R"({"sphere": {"centre_mm": [0, 0, -15], "radius_mm": 0.2}})")};
  expect_refused(SceneFolder(scene).run({"--no-render"}),
                 {"organs/0 (\"ball\"): fixed region: it holds no part of the surface"});
}

TEST(BadSceneFile, FewerNodesThanTheBasisNeedsAreRefused) {
  const Json coarse = {{"spacing_mm", 14}, {"finest_spacing_mm", 14}};
  expect_organ_refused({{"resolution", coarse}, {"formulation", "galerkin_quadratic"}},
                       {"found no fields that cover it", "make the node spacing finer"});
  expect_organ_refused({{"resolution", {{"spacing_mm", 100}, {"finest_spacing_mm", 100}}}},
                       {"expected at least 4", "finer spacing"});
}

TEST(BadSceneFile, MoreMemoryThanUlimitAllowsIsRefused) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need the address space";
  Json scene = tiny_scene();
  scene["smoke"][0]["voxel_mm"] = 0.2;  // 400^3 voxels
  const SceneFolder folder(scene);
  ProgramCall call = folder.call({"--no-render"});
  call.greatest_memory = 900u << 20;
  expect_refused(run_program(call), {"smoke/0", "80 % of ulimit -v", "a greater voxel_mm"});
}

struct WrongOption {
  const char* name;
  std::vector<std::string> options;
  std::vector<std::string> words;
};

class BadOption : public testing::TestWithParam<WrongOption> {};

TEST_P(BadOption, IsRefused) {
  const SceneFolder folder;
  expect_refused(folder.run(GetParam().options), GetParam().words);
  EXPECT_FALSE(fs::exists(folder.out()));
}

INSTANTIATE_TEST_SUITE_P(
    Run, BadOption,
    testing::Values(
        WrongOption{"Unknown", {"--frobnicate"}, {"--frobnicate"}},
        WrongOption{"NegativeThreads", {"--threads", "-1"}, {"--threads", "-1"}},
        WrongOption{"ThreadsInWords", {"--threads", "two"}, {"--threads", "two"}},
        WrongOption{"NoDuration", {"--duration", "nan"}, {"duration_s: found", "expected"}},
        WrongOption{"NegativeDuration", {"--duration", "-1"}, {"duration_s: found -1, expected"}},
        WrongOption{"SeedInWords", {"--seed", "dice"}, {"seed: found", "expected a whole number"}},
        WrongOption{"SetWithoutValue", {"--set", "seed"}, {"--set seed: expected KEY=VALUE"}},
        WrongOption{"SetWithoutKey", {"--set", "=3"}, {"--set =3: expected KEY=VALUE"}},
        WrongOption{
            "SetOfUnknownOrgan", {"--set", "organs/livr/tissue=liver"}, {"--set", "livr", "ball"}},
        WrongOption{"SetOfUnknownKey",
                    {"--set", "organs/ball/tisue=liver"},
                    {"organs/0/tisue: found an unknown key", "\"tissue\""}},
        WrongOption{"SetOfWrongValue",
                    {"--set", "organs/ball/geometry/radius_mm=-2"},
                    {"organs/0/geometry/radius_mm: found -2", "--set"}},
        WrongOption{"MissingAssets",
                    {"--assets", "/nowhere/at/all"},
                    {"--assets /nowhere/at/all: no such folder"}}),
    [](const auto& wrong) { return std::string(wrong.param.name); });

TEST(BadOption, NoCommandAndUnknownCommandAreRefused) {
  expect_refused(run_program({}), {"subcommand"});
  expect_refused(run_program({.arguments = {"fly"}}), {"fly"});
  expect_refused(run_program({.arguments = {"run"}}), {"scene"});
}

TEST(BadOption, HelpAndVersionAreNoMistakes) {
  const ProgramResult help = run_program({.arguments = {"--help"}});
  EXPECT_EQ(help.code, 0);
  for (const char* command : {"run", "check", "bench", "profile", "smoke-info"})
    EXPECT_NE(help.out.find(command), std::string::npos) << help.out;
  EXPECT_EQ(run_program({.arguments = {"--version"}}).code, 0);
}

}  // namespace
}  // namespace viscera::test
