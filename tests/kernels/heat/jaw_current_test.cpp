// Current between two jaws, against a slab's resistance and the heat book.
#include "kernels/heat/jaw_current.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0, kThick = 4e-3, kArea = 1e-6;

Bioheat tissue_everywhere() {
  return Bioheat(ThermalTissue{}, {});
}

/// Jaws of 5 x 5 mm with tissue of 4 mm between.
std::vector<JawColumn> between_jaws() {
  std::vector<JawColumn> columns;
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x)
      columns.push_back(
          {Vec3(1e-3 * x, 1e-3 * y, 0.5 * kThick), Vec3(1e-3 * x, 1e-3 * y, -0.5 * kThick), kArea});
  return columns;
}

double of_slab(double squeezed) {
  return squeezed * squeezed * kThick / (ThermalTissue{}.electric_conductivity * 25.0 * kArea);
}

TEST(JawCurrent, MeetsTheResistanceOfASlabAsItIsSqueezed) {
  for (const double squeezed : {1.0, 0.4}) {
    Bioheat heat = tissue_everywhere();
    const JawCurrent current(heat, between_jaws(), squeezed * kThick);
    EXPECT_NEAR(current.resistance(), of_slab(squeezed), 1e-3 * of_slab(squeezed));
    EXPECT_EQ(coagulated_between(heat, between_jaws()), 0.0);
  }
}

TEST(JawCurrent, HeatsWhatIsThickAndWhatIsThinAlikeBetweenTheSamePlates) {
  Bioheat heat = tissue_everywhere();
  std::vector<JawColumn> columns = between_jaws();
  for (JawColumn& column : columns)
    if (column.upper.x() < -0.5e-3) column.upper.z() = 0.0, column.lower.z() = -0.5 * kThick;
  JawCurrent(heat, columns, 0.3 * kThick).pass(heat, {}, 20.0, kFrame);
  heat.step(kFrame);
  const auto excess_at = [&](const Vec3& place) {
    return heat.bricks().excess_at(heat.bricks().voxel_of(place));
  };
  const double thick = excess_at(Vec3(1.2e-3, 0, 0.2e-3)),
               thin = excess_at(Vec3(-1.3e-3, 0, -1e-3));
  EXPECT_GT(thick, 0.5);
  EXPECT_NEAR(thin / thick, 1.0, 0.25);
}

TEST(JawCurrent, GivesThePowerThatItIsSetToEvenlyToWhatLiesBetween) {
  Bioheat heat = tissue_everywhere();
  const auto columns = between_jaws();
  JawCurrent current(heat, columns, 0.4 * kThick);
  const CurrentReport report = current.pass(heat, {}, 20.0, kFrame);
  EXPECT_NEAR(report.power, 20.0, 1e-9);
  EXPECT_NEAR(report.current * report.voltage, 20.0, 1e-9);
  EXPECT_EQ(report.body_power, 0.0) << "nothing goes through the rest of the body";
  double given = 0.0;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b)
    for (const float q : heat.bricks().brick(b).warm->source) given += q * heat.voxel_volume();
  EXPECT_NEAR(given, 20.0, 1e-4);
}

TEST(JawCurrent, EndsAtItsVoltageAndAtItsCurrent) {
  Bioheat heat = tissue_everywhere();
  JawCurrent current(heat, between_jaws(), kThick);
  const BipolarGenerator generator;
  const CurrentReport by_voltage = current.pass(heat, generator, 400.0, kFrame);
  EXPECT_NEAR(by_voltage.voltage, generator.most_voltage, 1e-9);
  EXPECT_EQ(by_voltage.by_voltage, 1.0);
  JawCurrent thin(heat, between_jaws(), 0.05 * kThick);
  const CurrentReport by_current = thin.pass(heat, generator, 400.0, kFrame);
  EXPECT_NEAR(by_current.current, generator.most_current, 1e-9);
  EXPECT_EQ(by_current.by_current, 1.0);
}

TEST(JawCurrent, CoagulatesAndDriesWhatItGoesThrough) {
  Bioheat heat = tissue_everywhere();
  const auto columns = between_jaws();
  double generated = 0.0, least = 1e9, last = 0.0, coagulated = 0.0;
  for (int frame = 0; frame < 600 && last < 3.0 * least; ++frame) {
    JawCurrent current(heat, columns, 0.4 * kThick);
    last = current.resistance();
    least = std::min(least, last);
    coagulated = coagulated_between(heat, columns);
    generated += current.pass(heat, {}, 40.0, kFrame).power * kFrame;
    heat.step(kFrame);
  }
  EXPECT_GT(last, 3.0 * least);
  EXPECT_LT(least, 0.7 * of_slab(0.4)) << "warm tissue conducts better before it dries";
  EXPECT_GT(coagulated, 0.9);
  // The water between weighs 0.08 g: some of it boils.
  EXPECT_GT(heat.vaporised_water(), 0.05 * 0.08e-3);
  EXPECT_NEAR(heat.book().delivered, generated, 1e-4 * generated);
  EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * generated);
  EXPECT_LT(heat.greatest_excess(), 400.0) << "it doesn't char";
}

TEST(JawCurrent, LeavesNoSliverOfTissueHotterThanChar) {
  // A surface 20 um below the upper jaw's: voxels there have little tissue.
  Bioheat heat(ThermalTissue{}, {}, [](const Vec3& p) { return p.z() - 0.48e-3; });
  std::vector<JawColumn> columns = between_jaws();
  for (JawColumn& column : columns) column.upper.z() = 0.5e-3;
  double gas = 0.0, generated = 0.0;
  for (int frame = 0; frame < 120; ++frame) {
    JawCurrent current(heat, columns, 0.4 * kThick);
    const CurrentReport report = current.pass(heat, {}, 200.0, kFrame);
    gas += report.gas_power * kFrame;
    generated += report.generated() * kFrame;
    EXPECT_NEAR(report.generated(), report.current * report.voltage, 1e-9 * report.generated());
    heat.step(kFrame);
  }
  EXPECT_LT(heat.greatest_excess() + heat.options().body, 1400.0);
  EXPECT_NEAR(heat.book().delivered, generated - gas, 1e-4 * generated);
}

TEST(JawCurrent, IsOpenWhereNoTissueLiesBetween) {
  BioheatOptions options;
  Bioheat heat(ThermalTissue{}, options, [](const Vec3&) { return 1.0; });
  JawCurrent current(heat, between_jaws(), kThick);
  EXPECT_TRUE(std::isinf(current.resistance()));
  const CurrentReport report = current.pass(heat, {}, 40.0, kFrame);
  EXPECT_TRUE(report.open);
  EXPECT_EQ(report.generated(), 0.0);
}

}  // namespace
}  // namespace viscera
