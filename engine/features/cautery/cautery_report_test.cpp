#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/features/cautery/cautery.h"
#include "engine/features/coagulation/coagulation.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;

/// A hook on the pole of a ball, with this current [W].
SceneDescription hook_on_ball(double power) {
  SceneDescription scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {straight_tool(
      "hook", InstrumentKind::kHook, 1e-3,
      {{0.0, Vec3(0, 0, kTop + 2e-3), power, 1.0}, {0.2, Vec3(0, 0, kTop + 0.2e-3), power, 1.0}})};
  return scene;
}

Json section(const std::vector<ReportSection>& sections, const std::string& key) {
  for (const ReportSection& one : sections)
    if (one.key == key) return Json::parse(one.json);
  ADD_FAILURE() << "no section " << key;
  return {};
}

TEST(CauteryReport, TellsWhereTheEnergyWentAndWhatItDidToTissue) {
  const SceneDescription scene = hook_on_ball(30.0);
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  const auto figures = cautery_figures(*world);
  ASSERT_TRUE(figures);
  EXPECT_GT(figures->delivered, 1.0);
  EXPECT_GE(figures->generated, figures->delivered);
  EXPECT_LT(std::abs(figures->residual), 0.01);
  const std::vector<BurnFigures> burns = burn_figures(*world);
  ASSERT_EQ(burns.size(), 1u);
  EXPECT_GT(burns[0].vaporised, 0.0);
  EXPECT_GT(burns[0].above_60, 0.0);
  EXPECT_GT(burns[0].greatest_temperature, 373.0);

  const std::vector<ReportSection> sections = cautery_report(*world);
  const Json cautery = section(sections, "cautery"), tissue = section(sections, "tissue");
  EXPECT_EQ(cautery["energy_generated_J"], figures->generated);
  EXPECT_EQ(cautery["energy_delivered_J"], figures->delivered);
  for (const char* key : {"metabolic_J", "stored_J", "latent_J", "perfused_J", "lost_J"})
    EXPECT_TRUE(cautery[key].is_number()) << key;
  for (const char* key : {"body_J", "sparks_J"})
    EXPECT_TRUE(cautery[key].is_null()) << key << ": nobody has watched every step";
  ASSERT_EQ(tissue.size(), 1u);
  EXPECT_EQ(tissue[0]["organ"], scene.organs[0].name);
  EXPECT_EQ(tissue[0]["volume_above_60C_m3"], burns[0].above_60);
  EXPECT_EQ(tissue[0]["volume_coagulated_m3"], burns[0].coagulated);
  EXPECT_EQ(tissue[0]["volume_dead_m3"], burns[0].dead);
  EXPECT_GT(burns[0].dead, burns[0].coagulated) << "the dose kills where nothing blanches yet";
  EXPECT_EQ(tissue[0]["greatest_temperature_K"], burns[0].greatest_temperature);
}

TEST(CauteryReport, StandsBesideWhatCoagulationTellsOfTheSameOrgan) {
  const auto world = build(hook_on_ball(30.0));
  ASSERT_TRUE(world);
  Json tissue = section(cautery_report(*world), "tissue");
  merge_section(tissue, section(coagulation_report(*world), "tissue"));
  ASSERT_EQ(tissue.size(), 1u);
  EXPECT_TRUE(tissue[0].contains("vaporised_kg"));
  EXPECT_TRUE(tissue[0].contains("stiffening"));
  EXPECT_TRUE(tissue[0]["stiffening"].is_null()) << "nothing has coagulated yet";
}

TEST(CauteryReport, WithoutCurrentThereIsNoBookAndHeatIsSkipped) {
  const SceneDescription scene = hook_on_ball(0.0);
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_FALSE(cautery_figures(*world));
  EXPECT_TRUE(section(cautery_report(*world), "cautery").is_null());
  EXPECT_EQ(section(cautery_report(*world), "tissue"), Json::array());
  ASSERT_EQ(cautery_skipped(scene).size(), 1u);
  EXPECT_EQ(cautery_skipped(scene)[0].what, "heat");
  EXPECT_TRUE(cautery_skipped(hook_on_ball(30.0)).empty());
}

}  // namespace
}  // namespace viscera::test
