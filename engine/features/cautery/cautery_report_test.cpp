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
  EXPECT_NEAR(cautery["energy_delivered_J"].get<double>() + cautery["body_J"].get<double>() +
                  cautery["sparks_metal_J"].get<double>() + cautery["sparks_gas_J"].get<double>(),
              figures->generated, 1e-4 * figures->generated);
  ASSERT_EQ(tissue.size(), 1u);
  EXPECT_EQ(tissue[0]["organ"], scene.organs[0].name);
  EXPECT_EQ(tissue[0]["volume_above_60C_m3"], burns[0].above_60);
  EXPECT_EQ(tissue[0]["volume_coagulated_m3"], burns[0].coagulated);
  EXPECT_EQ(tissue[0]["volume_dead_m3"], burns[0].dead);
  EXPECT_GT(burns[0].dead, burns[0].coagulated) << "the dose kills where nothing blanches yet";
  EXPECT_EQ(tissue[0]["greatest_temperature_K"], burns[0].greatest_temperature);
}

TEST(CauteryReport, EveryJouleOfSparksIsInItToo) {
  SceneDescription scene = hook_on_ball(40.0);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip = Vec3(0, 0, kTop + 1.6e-3);
  scene.instruments[0].extras.set(CurrentMode::kFulgurate);
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  const auto figures = cautery_figures(*world);
  ASSERT_TRUE(figures);
  EXPECT_GT(figures->sparks, 0.01 * figures->generated);
  EXPECT_LT(figures->sparks, figures->delivered);
  EXPECT_GT(figures->metal, 0.01 * figures->generated);
  EXPECT_GT(figures->gas, 0.0);
  EXPECT_NEAR(figures->delivered + figures->body + figures->metal + figures->gas,
              figures->generated, 1e-4 * figures->generated);
  const Json cautery = section(cautery_report(*world), "cautery");
  EXPECT_EQ(cautery["by_sparks_J"], figures->sparks);
  EXPECT_EQ(cautery["sparks_metal_J"], figures->metal);
  EXPECT_EQ(cautery["sparks_gas_J"], figures->gas);
}

TEST(CauteryReport, TellsTheImpedanceAndHowLongTheGeneratorWasAtItsLimits) {
  const auto world = build(hook_on_ball(30.0));
  ASSERT_TRUE(world);
  EXPECT_TRUE(section(cautery_report(*world), "cautery")["impedance"].is_null())
      << "no current has flowed";
  double time = 0.0, least = 1e9, greatest = 0.0, limited = 0.0;
  for (int frame = 1; frame <= 60; ++frame) {
    step_until(*world, frame / 60.0);
    const CurrentReport& current = world->all<BurnTrace>()[0].current;
    if (!(current.current > 0.0)) continue;
    time += 1.0;
    limited += current.by_voltage;
    least = std::min(least, current.resistance);
    greatest = std::max(greatest, current.resistance);
  }
  ASSERT_GT(time, 30.0);
  const Json cautery = section(cautery_report(*world), "cautery");
  const Json& impedance = cautery["impedance"];
  EXPECT_EQ(impedance["least_Ohm"], least);
  EXPECT_EQ(impedance["greatest_Ohm"], greatest);
  EXPECT_GT(impedance["mean_Ohm"], least);
  EXPECT_LT(impedance["mean_Ohm"], greatest);
  EXPECT_GT(least, Generator{}.body_resistance);
  EXPECT_NEAR(cautery["time_with_current_s"].get<double>(), time / 60.0, 0.02);
  // Frames end at whole milliseconds, so they aren't evenly long.
  EXPECT_NEAR(cautery["limited_by_voltage"].get<double>(), limited / time, 0.02);
  EXPECT_EQ(cautery["limited_by_current"], 0.0);
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
