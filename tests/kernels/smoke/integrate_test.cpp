#include "kernels/smoke/integrate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

SmokeParameters calm() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3::Zero(), Vec3(0.1, 0.1, 3.0));
  parameters.random_acceleration = parameters.swirl_acceleration = 0.0;
  parameters.crowding_speed = 0.0;
  parameters.cooling_time = 1e9;
  return parameters;
}

// Gas of one velocity everywhere, which keeps what it is given.
class Wind final : public SurroundingGas {
 public:
  Wind(const Vec3f& velocity, float theta) : velocity_(velocity), theta_(theta) {}
  void velocity(std::span<const Float4>, std::span<Float4> velocities) override {
    std::ranges::fill(velocities, Float4::from(velocity_));
  }
  void couple(std::span<const float>, std::span<float> theta) override {
    std::ranges::fill(theta, theta_);
  }
  void add_momentum(std::span<const Float4> impulses) override {
    for (const Float4& impulse : impulses) given += impulse.xyz().cast<double>();
  }
  Vec3 given = Vec3::Zero();

 private:
  Vec3f velocity_;
  float theta_;
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
  const double c = parameters.entrainment;
  const double lift =
      parameters.gravity * (1.0 - parameters.gas_temperature / (parameters.gas_temperature + 60.0));
  const double terminal = (-k + std::sqrt(k * k + 4.0 * c * lift)) / (2.0 * c);
  EXPECT_NEAR(smoke.particles().velocity(0).z(), terminal, 1e-4 * terminal);
}

TEST(Integrate, WhatDragTakesFromParcelsTheGasGets) {
  SmokeParameters parameters = calm();
  parameters.gravity = 0.0;
  SmokeVolume smoke(parameters);
  smoke.emit({.position = Vec3(0.05, 0.05, 0.05),
              .direction = Vec3::UnitX(),
              .speed = 0.2,
              .radius = 5e-3,
              .temperature = 0.0,
              .mass = 1e-8,
              .particles = 500});
  const double mass = parameters.gas_density * std::pow(0.5 * parameters.spacing, 3);
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (const Float4& v : smoke.particles().velocities) sum += mass * v.xyz().cast<double>();
    return sum;
  };
  const Vec3 before = momentum();
  Wind wind(Vec3f(0.0f, 0.05f, 0.0f), 0.7f);
  for (int i = 0; i < 10; ++i) smoke.step(1.0 / 60.0, {.gas = &wind});
  EXPECT_LT((momentum() + wind.given - before).norm(), 1e-5 * before.norm());
  EXPECT_LT(momentum().x(), 0.8 * before.x());
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
    Wind wind(Vec3f(0.1f, 0.0f, 0.0f), 1.0f);
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
