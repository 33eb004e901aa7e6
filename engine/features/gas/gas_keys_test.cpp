#include "engine/features/gas/gas_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(GasKeys, ArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const GasDescription& gas = gas_of(*scene);
  EXPECT_NEAR(gas.pressure, 1999.8, 0.1);
  EXPECT_DOUBLE_EQ(gas.temperature, 293.15);
  EXPECT_EQ(gas.cells, 24);
  EXPECT_DOUBLE_EQ(gas.cavity, 4e-3);
  EXPECT_NEAR(gas.compliance, 90e-6 / 133.322, 1e-10);
  EXPECT_DOUBLE_EQ(gas.humidity, 0.5);
  EXPECT_EQ(gas.domain->max(), Vec3(0.12, 0.11, 0.1));
}

TEST(GasKeys, LeftOutAreAsInTheStructure) {
  const Result<SceneDescription> scene = SceneFolder().load(least_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_NEAR(gas_of(*scene).pressure, GasDescription().pressure, 0.2);
  EXPECT_DOUBLE_EQ(gas_of(*scene).temperature, GasDescription().temperature);
  EXPECT_NEAR(gas_of(*scene).compliance, GasDescription().compliance,
              0.01 * gas_of(*scene).compliance);
  EXPECT_EQ(gas_of(*scene).humidity, GasDescription().humidity);
}

TEST(GasKeys, ASettingMakesTheGasThatTheFileLeavesOut) {
  SceneFolder folder;
  folder.options.overrides = {{"gas/pressure_mmHg", "0"}};
  const Result<SceneDescription> scene = folder.load(least_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(gas_of(*scene).pressure, 0.0);
}

TEST(GasKeys, GasComesThroughInletsAndLeavesThroughLeaksAndEvacuators) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const GasDescription& gas = gas_of(*scene);
  ASSERT_EQ(gas.inlets.size(), 1u);
  EXPECT_EQ(gas.inlets[0].direction, Vec3(0, 0, -1));
  EXPECT_DOUBLE_EQ(gas.inlets[0].limit, 1e-4);
  EXPECT_EQ(gas.inlets[0].when.to, 3.0);
  ASSERT_EQ(gas.leaks.size(), 1u);
  EXPECT_DOUBLE_EQ(gas.leaks[0].area, 2e-6);
  ASSERT_EQ(gas.evacuators.size(), 2u);
  EXPECT_EQ(gas.evacuators[0].instrument, "holder");
  EXPECT_EQ(gas.evacuators[1].instrument, "");
  EXPECT_EQ(gas.evacuators[1].position, Vec3(0.1, 0.01, 0.09));
  EXPECT_DOUBLE_EQ(gas.evacuators[1].flow, 5e-4);
  EXPECT_TRUE(gas.evacuators[1].when.contains(1e6));
}

TEST(GasKeys, KeysOfEarlierVersionsAreToldWhatToWriteInstead) {
  Json scene = whole_scene();
  scene["gas"]["leaks"][0].erase("area_mm2");
  scene["gas"]["leaks"][0]["radius_mm"] = 3;
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "gas/leaks/0/radius_mm",
                     "found a key of earlier versions, expected area_mm2");
  scene = whole_scene();
  scene["gas"]["inlets"][0].erase("limit_L_per_min");
  scene["gas"]["inlets"][0]["flow_L_per_min"] = 3;
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "gas/inlets/0/flow_L_per_min",
                     "found a key of earlier versions, expected limit_L_per_min");
}

TEST(GasKeys, GasFlowsInsideItsDomainWhichHoldsAllSmoke) {
  EXPECT_ONE_MISTAKE(mistakes_with("/gas/domain/max_mm", {90, 110, 100}), "gas/domain",
                     "expected a box that holds the smoke volume \"plume\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/gas/inlets/0/position_mm", {10, 10, 101}),
                     "gas/inlets/0/position_mm", "expected a place inside the gas's domain");
  Json scene = whole_scene();
  scene["gas"].erase("domain");
  EXPECT_TRUE(SceneFolder().mistakes(scene).empty());
  scene["gas"]["leaks"][0]["position_mm"] = {101, 10, 50};
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "gas/leaks/0/position_mm",
                     "[0,0,0] to [100,100,100]");
}

TEST(Gas, HasTheDensityOfCarbonDioxideUnderPressure) {
  EXPECT_NEAR(GasDescription().mixture().density(), 1.76, 0.005);
}

}  // namespace
}  // namespace viscera::test
