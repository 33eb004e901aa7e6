// Of `viscera bench steps`: errors fall with the length of a step, and what it refuses.
#include "tools/bench/bench_steps.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

using Json = nlohmann::json;

/// A ball at finite strain into which a probe goes, and out again.
SceneDescription pressed_ball(double way) {
  SceneDescription scene = soft_ball_scene(10e-3, 8e-3);
  scene.organs[0].response = Response::kFinite;
  scene.duration = 1.0;
  const double radius = 6e-3, above = 25e-3 + radius + 1e-3;
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, radius,
                                     {{0.0, Vec3(0, 0, above), 0.0, 1.0},
                                      {0.4, Vec3(0, 0, above - way), 0.0, 1.0},
                                      {0.8, Vec3(0, 0, above), 0.0, 1.0}})};
  return scene;
}

TEST(BenchSteps, ForceAndShapeErrLessTheShorterAStepIs) {
  const TemporaryFolder folder;
  const StepsBenchOptions options{.json = folder / "steps.json", .plots = folder / "plots"};
  std::ostringstream out;
  const auto done = bench_steps(pressed_ball(7e-3), test_tissues(), options, out);
  ASSERT_TRUE(done) << done.error().text();
  const Json cases = Json::parse(std::ifstream(options.json))["cases"];
  ASSERT_EQ(cases.size(), 4u);
  const auto error = [&](std::size_t i) { return cases[i]["force_errors"][0].get<double>(); };
  const auto farthest = [&](std::size_t i) { return cases[i]["shape_error_m"].get<double>(); };
  for (std::size_t i = 0; i + 1 < cases.size(); ++i) {
    EXPECT_GT(error(i), 1.5 * error(i + 1));
    EXPECT_GT(farthest(i), 1.5 * farthest(i + 1));
  }
  EXPECT_EQ(cases[0]["steps_per_s"], 30);
  EXPECT_LT(error(0), 0.2);
  EXPECT_EQ(error(3), 0.0);
  EXPECT_TRUE(std::filesystem::exists(folder / "plots" / "steps.svg"));
  EXPECT_NE(out.str().find("steps/s"), std::string::npos);
}

TEST(BenchSteps, AToolThatTouchesNothingIsRefused) {
  std::ostringstream out;
  const auto done = bench_steps(pressed_ball(0.0), test_tissues(), {}, out);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().text().find("found none that touches anything"), std::string::npos)
      << done.error().text();
}

}  // namespace
}  // namespace viscera::test
