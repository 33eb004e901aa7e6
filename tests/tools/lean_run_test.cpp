// What a scene doesn't need isn't touched: run in this process, where the counters can be asked.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/features/features.h"
#include "engine/gpu/egl_context.h"
#include "engine/io/smoke_file.h"
#include "engine/run/run.h"
#include "engine/scene/load_scene.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

TEST(LeanRun, SpherePressWithoutPicturesMakesNoEglAndNoOpenVdbCall) {
  const TemporaryFolder folder;
  SceneLoadOptions load;
  load.assets = project_file("assets");
  load.features = feature_keys();
  // The probe arrives after half a second; the rest of the scene adds time, not calls.
  load.overrides = {{"duration_s", "0.7"}};
  const auto scene = load_scene(project_file("scenes/sphere_press.json"), load);
  ASSERT_TRUE(scene) << scene.error().text();
  const auto tissues = load_tissues(load.assets / "tissues.json");
  ASSERT_TRUE(tissues) << tissues.error().text();

  RunOptions options;
  options.out = folder / "out";
  options.assets = load.assets;
  options.render = false;
  options.use_cache = false;
  options.quiet = true;
  // With graphics hardware `auto` has something to make a context for.
  if (egl_lists_hardware()) options.backend = Backend::kCpu;
  const auto report = run_scene(*scene, *tissues, options);
  ASSERT_TRUE(report) << report.error().text();

  EXPECT_EQ(egl_contexts_created(), 0);
  EXPECT_EQ(openvdb_initialisations(), 0);
  for (const char* part : {"rendering", "smoke", "haptics"})
    EXPECT_TRUE(std::any_of(report->skipped.begin(), report->skipped.end(),
                            [&](const SkippedReport& skipped) { return skipped.what == part; }))
        << part;
  EXPECT_EQ(report->frames, 42u);
  EXPECT_EQ(report->pictures, 0u);
  EXPECT_FALSE(std::filesystem::exists(options.out / "film.mp4"));
  EXPECT_FALSE(std::filesystem::exists(options.out / "frames"));
  EXPECT_FALSE(std::filesystem::exists(options.out / "smoke"));
}

}  // namespace
}  // namespace viscera::test
