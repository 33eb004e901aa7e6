// Organs that auto leaves linear in shipped scenes, against the same at finite strain.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/scenes/shipped_world.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

/// The force on each instrument [N], a row a frame; nothing where the scene can't be run.
std::vector<std::vector<double>> forces_of(const std::string& name, Response response) {
  const auto [scene, world] = build_shipped(name, [&](SceneDescription& shipped) {
    for (OrganDescription& organ : shipped.organs) organ.response = response;
  });
  if (!world) return {};
  EXPECT_EQ(world->all<OrganBody>()[0].model->finite != nullptr, response == Response::kFinite)
      << "auto leaves it linear";
  std::vector<std::vector<double>> forces;
  Trace trace(stage_names());
  while (world->time() < scene.duration - 1e-9) {
    step_frame(*world, trace);
    std::vector<double>& row = forces.emplace_back();
    for (const InstrumentContact& tool : world->all<InstrumentContact>())
      row.push_back(tool.force.norm());
  }
  return forces;
}

class LinearOrgan : public testing::TestWithParam<const char*> {};

TEST_P(LinearOrgan, PressesBackWithinFivePercentOfWhatItDoesAtFiniteStrain) {
  const auto linear = forces_of(GetParam(), Response::kAuto),
             finite = forces_of(GetParam(), Response::kFinite);
  ASSERT_EQ(linear.size(), finite.size());
  ASSERT_FALSE(finite.empty());
  for (std::size_t tool = 0; tool < finite[0].size(); ++tool) {
    double peak = 0.0, other = 0.0;
    for (std::size_t frame = 0; frame < finite.size(); ++frame) {
      peak = std::max(peak, finite[frame][tool]);
      other = std::max(other, linear[frame][tool]);
    }
    std::vector<double> errors;
    for (std::size_t frame = 0; frame < finite.size(); ++frame)
      if (finite[frame][tool] > 0.1 * peak)
        errors.push_back(std::abs(linear[frame][tool] / finite[frame][tool] - 1.0));
    ASSERT_FALSE(errors.empty()) << tool;
    std::ranges::sort(errors);
    EXPECT_NEAR(other, peak, 0.05 * peak) << tool;
    EXPECT_LT(errors[errors.size() / 2], 0.05) << tool;
    RecordProperty("tool_" + std::to_string(tool) + "_peak", std::to_string(other / peak - 1.0));
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, LinearOrgan,
                         testing::Values("hemisphere", "kidney_rubbed", "sphere_press"),
                         [](const auto& of) { return std::string(of.param); });

}  // namespace
}  // namespace viscera::test
