// `viscera check` over every scene that the project ships, and the lean one run from outside.
#include <gtest/gtest.h>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

struct Shipped {
  const char* scene;
  std::vector<std::string> organs, skipped;
};

ProgramResult check_shipped(const std::string& scene, const TemporaryFolder& cache,
                            const std::vector<std::string>& options = {}) {
  ProgramCall call;
  call.arguments = {"check", project_file("scenes/" + scene + ".json").string()};
  call.arguments.insert(call.arguments.end(), options.begin(), options.end());
  call.cache = cache.path();
  return run_program(call);
}

void expect_plan(const ProgramResult& result, const Shipped& shipped) {
  ASSERT_EQ(result.code, 0) << result.told();
  for (const std::string& organ : shipped.organs)
    EXPECT_NE(result.out.find("\n" + organ + " "), std::string::npos) << organ << result.told();
  for (const char* word : {"nodes", "memory", "expected preparation"})
    EXPECT_NE(result.out.find(word), std::string::npos) << word;
  const std::size_t skipped = result.out.find("\nskipped:\n");
  if (shipped.skipped.empty()) return;
  ASSERT_NE(skipped, std::string::npos) << result.told();
  for (const std::string& part : shipped.skipped)
    EXPECT_NE(result.out.find("  " + part + ": ", skipped), std::string::npos)
        << part << result.told();
}

class ShippedSceneCheck : public testing::TestWithParam<Shipped> {};

TEST_P(ShippedSceneCheck, SaysWhatWillBeBuiltAndSkipped) {
  const TemporaryFolder cache;
  expect_plan(check_shipped(GetParam().scene, cache), GetParam());
  EXPECT_TRUE(files_of(cache.path(), ".h5").empty()) << "a check prepares nothing";
}

INSTANTIATE_TEST_SUITE_P(
    All, ShippedSceneCheck,
    testing::Values(Shipped{"laparoscopic_cautery",
                            {"liver", "gallbladder", "stomach", "duodenum", "bile_ducts", "spleen",
                             "kidney_right", "kidney_left", "colon", "small_bowel", "omentum",
                             "diaphragm", "falciform_ligament", "abdominal_wall"},
                            {}},
                    Shipped{"stomach_cautery",
                            {"liver", "gallbladder", "stomach", "spleen", "colon", "small_bowel",
                             "omentum", "diaphragm", "falciform_ligament", "abdominal_wall"},
                            {}},
                    Shipped{"lesion_liver", {"liver"}, {}},
                    Shipped{"kidney_palpation", {"kidney"}, {"heat", "smoke"}},
                    Shipped{"lung_palpation", {"lung"}, {"heat", "smoke"}},
                    Shipped{"tilted_table",
                            {"liver", "stomach", "colon", "omentum", "diaphragm", "abdominal_wall"},
                            {"heat", "smoke", "haptics", "elasticity of stomach"}},
                    Shipped{"kidney_rubbed", {"kidney"}, {"heat", "smoke", "haptics"}},
                    Shipped{"liver_deep_palpation", {"liver"}, {"heat", "smoke"}},
                    Shipped{"liver_retraction",
                            {"liver", "stomach", "diaphragm", "abdominal_wall"},
                            {"heat", "smoke", "haptics", "elasticity of stomach"}},
                    Shipped{"gallbladder_lift",
                            {"gallbladder", "liver", "diaphragm", "abdominal_wall"},
                            {"heat", "smoke", "haptics"}},
                    Shipped{"retraction",
                            {"liver", "gallbladder", "bile_ducts", "upper_loop", "head_loop",
                             "foot_loop", "bowel_bed", "stomach", "duodenum", "colon", "spleen",
                             "diaphragm", "abdominal_wall"},
                            {"heat", "smoke", "haptics", "elasticity of stomach"}},
                    Shipped{"incision", {"liver"}, {"heat", "smoke", "haptics"}},
                    Shipped{"sever", {"pedicle"}, {"heat", "smoke", "haptics"}},
                    Shipped{"seal", {"pedicle"}, {"smoke", "haptics"}},
                    Shipped{"retrieval", {"pedicle"}, {"heat", "smoke", "haptics"}},
                    Shipped{"cutting_hook", {"liver"}, {"haptics"}},
                    Shipped{"sphere_press", {"sphere"}, {"heat", "smoke", "haptics"}},
                    Shipped{"hemisphere", {"hemisphere"}, {"heat", "smoke", "haptics"}}),
    [](const auto& shipped) { return std::string(shipped.param.scene); });

TEST(ShippedSceneCheck, VisibleHumanIsPlannedOnItsData) {
  const auto liver = shared_data("visible_human/VH_M_Liver.glb");
  if (!liver) GTEST_SKIP() << "the data folder is absent";
  const TemporaryFolder cache;
  const ProgramResult result = check_shipped(
      "visible_human_cautery", cache, {"--assets", liver->parent_path().parent_path().string()});
  expect_plan(result,
              {"visible_human_cautery", {"liver", "gallbladder", "kidney_left"}, {"haptics"}});
  // What wrapping did to the published surfaces is told.
  for (const char* organ : {"liver", "gallbladder", "kidney_left"})
    EXPECT_NE(result.out.find(std::string("\n") + organ + ": wrapped at voxels of "),
              std::string::npos)
        << organ << result.told();
}

TEST(ShippedSceneCheck, VisibleHumanWithoutItsDataSaysWhatIsMissing) {
  const TemporaryFolder cache;
  expect_refused(check_shipped("visible_human_cautery", cache),
                 {"organs/0/geometry/file: found no file \"VH_M_Liver.glb\""});
}

TEST(SpherePress, WithoutPicturesSkipsRenderingSmokeAndHaptics) {
  const TemporaryFolder folder;
  const Json report = run_shipped_scene("sphere_press", folder, {"--duration", "0.7"});
  ASSERT_FALSE(report.is_null());
  std::vector<std::string> skipped;
  for (const Json& part : report["skipped"]) skipped.push_back(part["what"]);
  for (const char* part : {"rendering", "smoke", "haptics"})
    EXPECT_NE(std::find(skipped.begin(), skipped.end(), part), skipped.end()) << part;
  EXPECT_EQ(report["pictures"], 0);
  EXPECT_EQ(report["smoke"]["volumes"], 0);
  expect_whole_files(folder / "out");
}

}  // namespace
}  // namespace viscera::test
