// A graphics driver that resets its device in the middle of a run: in this process, where that can
// be made to happen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "engine/features/features.h"
#include "engine/run/run.h"
#include "engine/scene/load_scene.h"
#include "tests/support/paths.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

class LostContext : public testing::Test {
 protected:
  void SetUp() override {
    const auto context = EglContext::create();
    if (!context) GTEST_SKIP() << context.error().text();
  }

  Result<RunReport> run(Backend backend, bool render) const {
    SceneLoadOptions load;
    load.assets = project_file("assets");
    load.features = feature_keys();
    const auto scene = load_scene(folder_.scene(), load);
    EXPECT_TRUE(scene) << scene.error().text();
    const auto tissues = load_tissues(load.assets / "tissues.json");
    EXPECT_TRUE(tissues) << tissues.error().text();
    RunOptions options;
    options.out = folder_.out();
    options.assets = load.assets;
    options.render = render;
    options.quality = Quality::kDraft;
    options.backend = backend;
    options.use_cache = false;
    options.quiet = true;
    options.width = 320;
    options.height = 180;
    options.passes = render ? std::set<Pass>{Pass::kDepth} : std::set<Pass>{};
    options.lose_context_at = 6;
    return run_scene(*scene, *tissues, options);
  }

  static bool warns(const RunReport& report, const std::string& part) {
    return std::ranges::any_of(report.warnings, [&](const std::string& warning) {
      return warning.find(part) != std::string::npos;
    });
  }

  const SceneFolder folder_;
};

TEST_F(LostContext, ARunOnTheGpuGoesOnOnTheCpuWithItsPicturesAndSaysSo) {
  const auto report = run(Backend::kGpu, true);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_TRUE(report->complete);
  EXPECT_EQ(report->frames, 12u);
  EXPECT_EQ(report->pictures, 6u);
  for (const char* part : {"organs on the GPU: its context was lost", "smoke on the GPU",
                           "heat on the GPU: its context was lost: that of organ \"ball\" went on",
                           "pictures went on with another one"})
    EXPECT_TRUE(warns(*report, part)) << part;
  EXPECT_EQ(files_of(folder_.out() / "frames", ".png").size(), 6u);
  EXPECT_EQ(files_of(folder_.out() / "passes", ".exr").size(), 6u);
  EXPECT_TRUE(fs::exists(folder_.out() / "film.mp4"));
  for (const std::string& flag : report->flags)
    EXPECT_EQ(flag.find("frozen"), std::string::npos) << flag;
  EXPECT_GT(folder_.report()["smoke"]["airborne_kg"], 0.0);
  expect_whole_files(folder_.out());
}

TEST_F(LostContext, ARunWithoutPicturesGoesOnOnTheCpu) {
  const auto report = run(Backend::kGpu, false);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_TRUE(report->complete);
  EXPECT_TRUE(warns(*report, "organs on the GPU: its context was lost"));
  EXPECT_TRUE(warns(*report, "that smoke went on on the CPU"));
  EXPECT_TRUE(warns(*report, "that of organ \"ball\" went on on the CPU"));
  ASSERT_TRUE(report->gpu);
  EXPECT_EQ(report->gpu->heat_organs, 1u);
  // What was burnt before and after the loss is one burn, whose energy is all there.
  const Json cautery = folder_.report()["cautery"];
  EXPECT_GT(cautery["energy_delivered_J"], 0.0);
  EXPECT_LT(std::abs(cautery["residual"].get<double>()), 1e-3);
}

TEST_F(LostContext, ARunOnTheCpuLosesNoPicture) {
  const auto report = run(Backend::kCpu, true);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_EQ(report->pictures, 6u);
  EXPECT_TRUE(warns(*report, "pictures went on with another one"));
}

}  // namespace
}  // namespace viscera::test
