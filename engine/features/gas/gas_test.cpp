// The gas of a cavity in a world: its pressure, what comes and goes.
#include "engine/features/gas/gas.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/smoke/smoke.h"
#include "tests/support/small_world.h"
#include "tests/support/smoking_ball.h"

namespace viscera::test {
namespace {

constexpr double kLitreAMinute = 1e-3 / 60.0;
constexpr double kTwelve = 12.0 * kPascalPerMillimetreOfMercury;

/// A ball in a closed cavity, and a place that gives smoke.
SceneDescription cavity_scene() {
  SceneDescription scene = smoking_ball_scene();
  scene.extras.get<GasDescription>().pressure = kTwelve;
  return scene;
}

TEST(GasStages, AtTwelveMillimetresNoAirComesInWhateverIsDrawn) {
  SceneDescription scene = cavity_scene();
  GasDescription& gas = scene.extras.get<GasDescription>();
  gas.inlets = {{Vec3(-30e-3, 0, 60e-3), Vec3::UnitX(), 3e-3, 3.0 * kLitreAMinute, {}}};
  gas.leaks = {{Vec3(35e-3, 35e-3, 80e-3), 1.3e-6}};
  gas.evacuators = {{"", Vec3(20e-3, 0, 60e-3), 6e-3, 10.0 * kLitreAMinute, {}}};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.5);
  const GasBody& body = *world->one<GasBody>();
  const Cavity::State& cavity = body.cavity.state();
  // 10 and 2 L/min out, 3 in: over 1.5 s 0.22 L less, which the wall yields at 106 mL a mmHg.
  EXPECT_EQ(cavity.book.air, 0.0);
  EXPECT_GT(cavity.leaks[0], 1.5 * kLitreAMinute);
  EXPECT_NEAR(cavity.insufflation, 3.0 * kLitreAMinute, 1e-9);
  EXPECT_NEAR((kTwelve - cavity.pressure) / kPascalPerMillimetreOfMercury, 2.0, 0.2);
  // The grid's flow has the same.
  EXPECT_NEAR(body.grid->report().leaks[0], cavity.leaks[0], 1e-9);
  EXPECT_NEAR(body.grid->report().inlets[0], cavity.insufflation, 1e-9);
  EXPECT_NEAR(body.grid->report().evacuators[0], 10.0 * kLitreAMinute, 1e-9);
}

TEST(GasStages, AnInsufflatorThatIsStrongEnoughKeepsThePressure) {
  SceneDescription scene = cavity_scene();
  GasDescription& gas = scene.extras.get<GasDescription>();
  gas.inlets = {{Vec3(-30e-3, 0, 60e-3), Vec3::UnitX(), 3e-3, 12.0 * kLitreAMinute, {}},
                {Vec3(30e-3, 0, 60e-3), -Vec3::UnitX(), 3e-3, 4.0 * kLitreAMinute, {}}};
  gas.evacuators = {{"", Vec3(20e-3, 0, 60e-3), 6e-3, 10.0 * kLitreAMinute, {}}};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.5);
  const GasBody& body = *world->one<GasBody>();
  EXPECT_NEAR(body.cavity.pressure(), kTwelve, 0.3 * kPascalPerMillimetreOfMercury);
  EXPECT_NEAR(body.cavity.state().insufflation, 10.0 * kLitreAMinute, 0.1 * kLitreAMinute);
  // The inlets share it by their limits.
  EXPECT_NEAR(body.grid->report().inlets[0], 3.0 * body.grid->report().inlets[1], 1e-9);
}

TEST(GasStages, SteamThatIsGivenRaisesThePressureWithAndWithoutCells) {
  for (const int cells : {16, 0}) {
    SceneDescription scene = cavity_scene();
    GasDescription& gas = scene.extras.get<GasDescription>();
    gas.cells = cells;
    const auto with = build(scene), without = build(scene);
    ASSERT_TRUE(with && without);
    // What 20 W boil in a third of a second.
    GasSource source;
    source.position = Vec3(0, 0, 40e-3);
    source.gift = GasGift::steam(gas.mixture(), 0.15e-6, 373.15);
    for (int frame = 1; frame <= 20; ++frame) {
      give_to_gas(*with, source);
      step_until(*with, frame / 60.0);
      step_until(*without, frame / 60.0);
    }
    step_until(*with, 0.4);
    step_until(*without, 0.4);
    const double rise =
        with->one<GasBody>()->cavity.pressure() - without->one<GasBody>()->cavity.pressure();
    // Its moles stay, and most of its heat, be it in vapour or given off.
    const double yields = gas.compliance + gas.cavity / (gas::kAtmosphere + kTwelve);
    const double expected = 20.0 * source.gift.volume / yields;
    EXPECT_GT(rise, 0.6 * expected) << cells;
    EXPECT_LT(rise, 1.4 * expected) << cells;
  }
}

TEST(GasStages, FlowGoesWhereAnOrganWasBeforeItWasDrawnAside) {
  const auto world = build(cavity_scene());
  ASSERT_TRUE(world);
  step_until(*world, 0.2);
  const GasGrid& grid = *world->one<GasBody>()->grid;
  const auto solid_at = [&](const Vec3& place) {
    const Vec3 cell =
        (place - grid.parameters().domain.min()).cwiseQuotient(grid.spacing()).array().floor();
    return grid.is_solid(static_cast<int>(cell.x()), static_cast<int>(cell.y()),
                         static_cast<int>(cell.z()));
  };
  OrganState& ball = world->all<OrganState>()[0];
  Vec3f middle = Vec3f::Zero();
  for (const Vec3f& vertex : ball.positions)
    middle += vertex / static_cast<float>(ball.positions.size());
  const Vec3 place =
      pose_of(*world, world->all<OrganBody>().owner(0)).to_world(middle.cast<double>());
  ASSERT_TRUE(solid_at(place));
  // Its frame stays where it is: the shape alone goes.
  for (Vec3f& vertex : ball.positions) vertex += Vec3f(0, 0, 60e-3f);
  step_until(*world, 0.3);
  EXPECT_FALSE(solid_at(place));
}

TEST(GasStages, TheReportHasThePressureAndABookThatCloses) {
  SceneDescription scene = cavity_scene();
  GasDescription& gas = scene.extras.get<GasDescription>();
  gas.inlets = {{Vec3(-30e-3, 0, 60e-3), Vec3::UnitX(), 3e-3, 3.0 * kLitreAMinute, {}}};
  gas.leaks = {{Vec3(35e-3, 35e-3, 80e-3), 1.3e-6}};
  gas.evacuators = {{"", Vec3(20e-3, 0, 60e-3), 6e-3, 10.0 * kLitreAMinute, {0.2, 0.6}}};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  const std::vector<ReportSection> sections = gas_report(*world);
  ASSERT_EQ(sections.size(), 1u);
  EXPECT_EQ(sections[0].key, "gas");
  const Json report = Json::parse(sections[0].json);
  const auto value = [&](const char* key) { return report[key].get<double>(); };
  EXPECT_LT(value("pressure_least_mmHg"), value("pressure_mmHg"));
  EXPECT_GT(value("pressure_mmHg"), 10.0);
  EXPECT_NEAR(value("pressure_greatest_mmHg"), 12.0, 0.05);
  EXPECT_NEAR(value("evacuated_L"), 10.0 * 0.4 / 60.0, 2e-3);
  const double scale = (101.325 + 0.133322 * value("pressure_mmHg")) / (101.325 + 1.6);
  EXPECT_NEAR(3.0 + value("insufflated_L") + value("swollen_L") + value("air_L"),
              value("volume_L") * scale + value("evacuated_L") + value("leaked_L"), 1e-4);
}

TEST(GasStages, WithoutSmokeThereIsNoCavityToTellOf) {
  const auto world = build(soft_ball_scene(8e-3, 5e-3));
  ASSERT_TRUE(world);
  EXPECT_TRUE(gas_report(*world).empty());
}

}  // namespace
}  // namespace viscera::test
