#include "kernels/smoke/integrate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

SmokeParameters calm() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3::Zero(), Vec3(0.1, 0.1, 3.0));
  parameters.eddies.share = 0.0;
  parameters.crowding_speed = 0.0;
  parameters.prandtl = 1e9;  // they stay warm
  return parameters;
}

// Gas of one velocity and temperature everywhere.
class Wind final : public SurroundingGas {
 public:
  explicit Wind(const Vec3f& velocity, float excess = 0.0f)
      : velocity_(velocity), excess_(excess) {}
  void velocity(std::span<const Float4>, std::span<Float4> velocities) override {
    std::ranges::fill(velocities, Float4::from(velocity_));
  }
  void excess(std::span<const Float4>, std::span<float> kelvin) override {
    std::ranges::fill(kelvin, excess_);
  }

 private:
  Vec3f velocity_;
  float excess_;
};

// A lone hot parcel in gas at rest: g (1 - T0/T) = k v + c v^2, k = (1 - phi) 18 nu/h^2, phi of its
// own.
TEST(Integrate, AHotParcelRisesAtItsTerminalVelocity) {
  const SmokeParameters parameters = calm();
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.05, 0.05, 0.01),
              .speed = 0.0,
              .radius = 0.0,
              .temperature = 60.0,
              .mass = 1e-9,
              .particles = 1});
  for (int i = 0; i < 600; ++i) smoke.step(1.0 / 60.0);
  const double h = parameters.spacing;
  const double phi = 315.0 / (64.0 * 3.14159265358979) / 8.0;
  const double k = (1.0 - phi) * 18.0 * effective_viscosity(parameters) / (h * h);
  const double c = jet_drag(parameters).quadratic;
  const double lift =
      parameters.gravity * (1.0 - parameters.gas_temperature / (parameters.gas_temperature + 60.0));
  const double terminal = (-k + std::sqrt(k * k + 4.0 * c * lift)) / (2.0 * c);
  EXPECT_NEAR(smoke.particles().velocity(0).z(), terminal, 1e-4 * terminal);
}

// dT/dt = -(k + c v) / Pr T where gas is at rest; here v follows from its own drag alone.
TEST(Integrate, AParcelLosesHeatToGasAtRestAsItLosesMomentum) {
  SmokeParameters parameters = calm();
  parameters.prandtl = 0.5;
  parameters.jet_entrainment = 0.0;
  parameters.gravity = 0.0;
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.05, 0.05, 0.01),
              .direction = Vec3::UnitX(),
              .speed = 0.3,
              .radius = 0.0,
              .temperature = 60.0,
              .mass = 1e-9,
              .particles = 1});
  for (int i = 0; i < 500; ++i) smoke.step(1e-4);
  const double slower = smoke.particles().velocity(0).x() / 0.3;
  EXPECT_LT(slower, 0.5);
  EXPECT_NEAR(smoke.particles().temperature(0) / 60.0, slower * slower, 2e-3);
}

TEST(Integrate, ParcelsInGasFollowItAndAreAsWarm) {
  SmokeVolume smoke(calm());
  smoke.emit({.position = Vec3(0.05, 0.05, 0.05),
              .direction = Vec3::UnitX(),
              .speed = 0.2,
              .radius = 5e-3,
              .temperature = 60.0,
              .mass = 1e-8,
              .particles = 500});
  Wind wind(Vec3f(0.0f, 0.05f, 0.0f), 7.0f);
  for (int i = 0; i < 40; ++i) smoke.step(1.0 / 60.0, {.gas = &wind});
  for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
    EXPECT_LT((smoke.particles().velocity(i) - Vec3f(0.0f, 0.05f, 0.0f)).norm(), 1e-4f);
    EXPECT_EQ(smoke.particles().temperature(i), 7.0f);
  }
}

// dv/dt = -k v - c v^2 by many steps.
TEST(Integrate, AJetRunsAsFarAheadOfTheGasAsItsDragLetsIt) {
  const JetDrag drag = jet_drag(calm());
  for (const double start : {0.1, 1.0, 10.0}) {
    double speed = start, way = 0.0;
    constexpr int kSteps = 200000;
    constexpr double kTime = 0.05;
    for (int i = 0; i < kSteps; ++i) {
      const double half =
          speed - 0.5 * kTime / kSteps * (drag.linear * speed + drag.quadratic * speed * speed);
      way += kTime / kSteps * half;
      speed -= kTime / kSteps * (drag.linear * half + drag.quadratic * half * half);
    }
    EXPECT_NEAR(drag.speed_after(start, kTime), speed, 1e-6 * start);
    EXPECT_NEAR(drag.way_after(start, kTime), way, 1e-6);
    EXPECT_NEAR(drag.way_after(drag.speed_for(0.02), 100.0), 0.02, 1e-9);
  }
}

TEST(Integrate, AJetThatHasNoRoomEndsBeforeTheObstacle) {
  SmokeVolume smoke(calm());
  Wind still(Vec3f::Zero());
  SmokeEmission jet = {.position = Vec3(0.05, 0.05, 0.01),
                       .speed = 20.0,
                       .radius = 0.0,
                       .mass = 1e-8,
                       .particles = 200,
                       .duration = 1.0 / 60.0};
  const auto highest = [&] {
    float most = 0.0f;
    for (const Float4& at : smoke.particles().positions) most = std::max(most, at.z);
    return most - 0.01f;
  };
  smoke.emit(jet);
  for (int i = 0; i < 60; ++i) smoke.step(1.0 / 60.0, {.gas = &still});
  EXPECT_GT(highest(), 0.05f);
  smoke = SmokeVolume(calm());
  jet.reach = 0.03;
  smoke.emit(jet);
  for (int i = 0; i < 60; ++i) smoke.step(1.0 / 60.0, {.gas = &still});
  EXPECT_LT(highest(), 0.036f);
  EXPECT_GT(highest(), 0.02f);
}

TEST(Integrate, DragNeverOvershootsTheGas) {
  for (const double dt : {1e-3, 0.1, 10.0}) {
    SmokeVolume smoke(calm());
    smoke.emit({.position = Vec3(0.05, 0.05, 0.05),
                .direction = Vec3::UnitX(),
                .speed = 5.0,
                .radius = 0.0,
                .temperature = 0.0,
                .mass = 1e-9,
                .particles = 1});
    Wind wind(Vec3f(0.1f, 0.0f, 0.0f));
    smoke.step(dt, {.gas = &wind});
    EXPECT_GE(smoke.particles().velocity(0).x(), dt > 0.05 ? -1.0f : 0.1f);
    EXPECT_LE(smoke.particles().velocity(0).x(), 5.0f);
  }
}

TEST(Integrate, NearlyNormalNumbersHaveMeanZeroAndVarianceOne) {
  double sum = 0.0, square = 0.0, cross = 0.0;
  const int count = 200000;
  for (int i = 0; i < count; ++i) {
    const RandomWords words = random_words(static_cast<std::uint32_t>(i), 7, 1);
    const double x = nearly_normal(words.x), y = nearly_normal(words.y);
    sum += x, square += x * x, cross += x * y;
  }
  EXPECT_NEAR(sum / count, 0.0, 0.01);
  EXPECT_NEAR(square / count, 1.0, 0.01);
  EXPECT_NEAR(cross / count, 0.0, 0.01);
}

}  // namespace
}  // namespace viscera
