#include "kernels/smoke/smoke.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "kernels/base/hash.h"
#include "kernels/base/random.h"
#include "kernels/smoke/gas_around.h"

namespace viscera {
namespace {

SmokeParameters cavity() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(-0.1, -0.1, 0.3), Vec3(0.1, 0.1, 0.5));
  return parameters;
}

// Nothing but the exchange of momentum between particles.
SmokeParameters pairs_only() {
  SmokeParameters parameters = cavity();
  parameters.eddies.share = 0.0;
  parameters.gravity = 0.0;
  parameters.gas_drag = 0.0;
  parameters.jet_entrainment = 0.0;
  return parameters;
}

SmokeEmission plume_source(int particles) {
  return {.position = Vec3(0.0, 0.0, 0.31),
          .mass = 1e-8 * particles,
          .particles = particles,
          .duration = 1.0 / 60.0};
}

void emit_one(SmokeVolume& smoke, const Vec3& position, const Vec3& velocity) {
  SmokeEmission emission;
  emission.position = position;
  emission.direction = velocity.norm() > 0.0 ? velocity : Vec3(Vec3::UnitX());
  emission.speed = velocity.norm();
  emission.radius = 0.0;
  emission.temperature = 0.0;
  emission.mass = 1e-9;
  emission.particles = 1;
  smoke.emit(emission);
}

std::string state_hash(const SmokeVolume& smoke) {
  const SmokeParticles& p = smoke.particles();
  Hasher hasher;
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (const Float4& v : {p.positions[i], p.velocities[i]}) {
      hasher.value(v.x).value(v.y).value(v.z).value(v.w);
    }
  }
  hasher.array(std::span(p.masses)).array(std::span(p.ids));
  return hasher.hex();
}

Vec3 momentum(const SmokeVolume& smoke) {
  Vec3 sum = Vec3::Zero();
  for (const Float4& v : smoke.particles().velocities) sum += v.xyz().cast<double>();
  return sum;
}

TEST(Smoke, HashIsTheSameForOneTwoAndFiveThreads) {
  const auto run = [](int threads) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    SmokeVolume smoke(cavity());
    RestingGas gas;
    SmokeObstacle tool = {
        .from = Vec3(0.004, 0.0, 0.32), .to = Vec3(0.05, 0.0, 0.36), .radius = 3e-3};
    for (int frame = 0; frame < 90; ++frame) {
      smoke.emit(plume_source(40));
      tool.from_before = tool.from, tool.to_before = tool.to;
      tool.from.x() -= 1e-4;
      smoke.step(1.0 / 60.0, {.gas = &gas, .obstacles = {&tool, 1}});
    }
    SmokeGrid grid;
    splat(smoke, 2e-3, grid);
    return state_hash(smoke) + Hasher().array(std::span<const float>(grid.density)).hex();
  };
  const std::string one = run(1);
  EXPECT_EQ(one, run(2));
  EXPECT_EQ(one, run(5));
  EXPECT_EQ(one, run(2));
}

TEST(Smoke, AnotherSeedGivesAnotherPlume) {
  const auto run = [](std::uint64_t seed) {
    SmokeParameters parameters = cavity();
    parameters.seed = seed;
    SmokeVolume smoke(parameters);
    smoke.emit(plume_source(100));
    smoke.step(1.0 / 60.0);
    return state_hash(smoke);
  };
  EXPECT_NE(run(1), run(2));
}

TEST(Smoke, PairsExchangeMomentumWithoutMakingAny) {
  SmokeVolume smoke(pairs_only());
  const Random random(5, 0);
  double largest = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 position = Vec3(0.0, 0.0, 0.4) +
                          0.01 * std::cbrt(random.uniform(7 * i + 6)) * Random(6, 0).direction(i);
    const Vec3 velocity = 0.05 * Vec3(random.normal(5 * i), random.normal(5 * i + 1), 1.0);
    emit_one(smoke, position, velocity);
    largest += velocity.norm();
  }
  const Vec3 before = momentum(smoke);
  const auto spread = [&] {
    double sum = 0.0;
    const Vec3 mean = momentum(smoke) / 3000.0;
    for (const Float4& v : smoke.particles().velocities) {
      sum += (v.xyz().cast<double>() - mean).squaredNorm();
    }
    return sum;
  };
  const double spread_before = spread();
  for (int i = 0; i < 20; ++i) smoke.step(1.0 / 60.0);
  RecordProperty("relative_drift", std::to_string((momentum(smoke) - before).norm() / largest));
  EXPECT_LT((momentum(smoke) - before).norm(), 1e-6 * largest);
  // It did exchange: viscosity evens the velocities out.
  EXPECT_LT(spread(), 0.2 * spread_before);
}

/// Gas that rests but for eddies of one speed.
class Eddies final : public SurroundingGas {
 public:
  explicit Eddies(float speed) : speed_(speed) {}
  void velocity(std::span<const Float4>, std::span<Float4> velocities) override {
    std::ranges::fill(velocities, Float4{0.0f, 0.0f, 0.0f, speed_});
  }
  void excess(std::span<const Float4>, std::span<float> kelvin) override {
    std::ranges::fill(kelvin, 0.0f);
  }

 private:
  float speed_;
};

/// What a plume of 0.3 W comes to in a second and a half, with an evacuator beside it.
struct Outcome {
  double height = 0.0;     // mean of the airborne mass, over the source [m]
  double evacuated = 0.0;  // [kg]
  double speed = 0.0;      // upward, of parcels 0.05 to 0.2 s old [m/s]
  double width = 0.0;      // deviation of the parcels' places across [m]
};

Outcome plume_of(int particles_a_frame, std::uint64_t seed) {
  constexpr double kFrame = 1.0 / 60.0;
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(-0.06, -0.06, 0.0), Vec3(0.06, 0.06, 0.12));
  parameters.seed = seed;
  GasParameters room;
  room.domain = parameters.domain;
  room.cells = 20;
  GasGrid grid(room);
  SmokeVolume smoke(parameters);
  const GasEvacuator suction = {.position = Vec3(0.015, 0.0, 0.06), .flow = 1e-4};
  const SmokeOutlet outlet = {.position = suction.position, .radius = 8e-3, .flow = suction.flow};
  grid.set_evacuators({&suction, 1});
  const Vec3 source(0.0, 0.0, 0.015);
  for (int frame = 0; frame < 90; ++frame) {
    smoke.emit({.position = source,
                .speed = 0.3,
                .mass = 4e-8,
                .particles = particles_a_frame,
                .duration = kFrame});
    grid.give(
        {.position = source, .impulse = 1e-9, .gift = GasGift::warmth(room.mixture, 0.3 * kFrame)});
    GasAround around(grid, parameters.domain.min());
    smoke.step(kFrame, {.gas = &around, .outlets = {&outlet, 1}});
    grid.step(kFrame);
  }
  Outcome outcome;
  const SmokeParticles& particles = smoke.particles();
  int young = 0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    outcome.width += std::pow(particles.position(i).x() - 0.06, 2) / particles.size();
    if (particles.age(i) < 0.05f || particles.age(i) > 0.2f) continue;
    outcome.speed += particles.velocity(i).z();
    ++young;
  }
  outcome.speed /= young;
  outcome.width = std::sqrt(outcome.width);
  for (std::size_t i = 0; i < particles.size(); ++i)
    outcome.height += smoke.particles().masses[i] *
                      (smoke.particles().position(i).z() - source.z()) / smoke.airborne();
  outcome.evacuated = smoke.book().evacuated;
  return outcome;
}

TEST(Smoke, APlumeRisesAtDecimetresASecondAndSpreads) {
  const Outcome plume = plume_of(20, 3);
  // 0.3 W rises at (B / (2 pi nu))^(1/2) = 0.27 m/s at most.
  EXPECT_GT(plume.height, 0.03);
  EXPECT_GT(plume.speed, 0.1);
  EXPECT_LT(plume.speed, 0.3);
  EXPECT_GT(plume.width, 0.01);
}

TEST(Smoke, FiveTimesHeavierParcelsRiseAsHighAndLeaveAsMuchSmoke) {
  const auto mean = [](int particles) {
    Outcome sum;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const Outcome one = plume_of(particles, seed);
      sum.height += one.height / 8.0, sum.evacuated += one.evacuated / 8.0;
    }
    return sum;
  };
  const Outcome light = mean(40), heavy = mean(8);
  RecordProperty("height_m", std::to_string(light.height) + " " + std::to_string(heavy.height));
  RecordProperty("evacuated_ug", std::to_string(1e9 * light.evacuated) + " " +
                                     std::to_string(1e9 * heavy.evacuated));
  EXPECT_GT(light.height, 0.03);
  EXPECT_GT(light.evacuated, 0.02 * 90 * 4e-8);
  EXPECT_NEAR(heavy.height, light.height, 0.05 * light.height);
  EXPECT_NEAR(heavy.evacuated, light.evacuated, 0.05 * light.evacuated);
}

TEST(Smoke, DiffusionByTheWhitePartOfEddiesDoesNotDependOnTheStep) {
  const auto spread = [](int steps_a_frame) {
    SmokeParameters parameters = cavity();
    parameters.eddies.wavelength = 0.0;
    parameters.eddies.white = 1.0;
    parameters.jet_entrainment = 0.0;
    Eddies gas(0.02f);
    SmokeVolume smoke(parameters);
    // Far apart: no neighbours.
    for (int i = 0; i < 4000; ++i) {
      emit_one(smoke,
               parameters.domain.center() +
                   5e-3 * (Vec3(i % 16, i / 16 % 16, i / 256).array() - 7.5).matrix(),
               Vec3::Zero());
    }
    for (int i = 0; i < 60 * steps_a_frame; ++i)
      smoke.step(1.0 / 60.0 / steps_a_frame, {.gas = &gas});
    double sum = 0.0;
    for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
      const int id = static_cast<int>(smoke.particles().ids[i]);
      const Vec3 start = 5e-3 * (Vec3(id % 16, id / 16 % 16, id / 256).array() - 7.5).matrix() +
                         parameters.domain.sizes() / 2.0;
      sum += (smoke.particles().position(i).cast<double>() - start).squaredNorm();
    }
    return sum / 4000.0;
  };
  const double coarse = spread(1);
  EXPECT_GT(coarse, 1e-6);
  EXPECT_NEAR(spread(4), coarse, 0.15 * coarse);
}

TEST(Smoke, EddiesCarryItAtTheirSpeedAndLeaveItAtRestWhereThereAreNone) {
  const auto root_mean_square = [](float eddies) {
    SmokeVolume smoke(cavity());
    Eddies gas(eddies);
    for (int i = 0; i < 1000; ++i)
      emit_one(smoke,
               Vec3(0.01 * (i % 10) - 0.05, 0.01 * (i / 10 % 10) - 0.05, 0.35 + 1e-3 * (i / 100)),
               0.05 * Random(3, 0).direction(i));
    double sum = 0.0;
    for (int frame = 0; frame < 180; ++frame) {
      smoke.step(1.0 / 60.0, {.gas = &gas});
      if (frame < 60) continue;
      for (const Float4& v : smoke.particles().velocities) sum += v.xyz().squaredNorm() / 3.0;
    }
    return std::sqrt(sum / (120.0 * 1000.0));
  };
  // A parcel follows with the delay of its drag: eddies that change faster carry it less.
  EXPECT_LT(root_mean_square(0.05f), 0.05 * 1.1);
  EXPECT_GT(root_mean_square(0.05f), 0.05 * 0.7);
  EXPECT_LT(root_mean_square(0.0f), 1e-9);
}

TEST(Smoke, EmittedIsAirborneBackgroundEvacuatedLeakedAndDeposited) {
  SmokeParameters parameters = cavity();
  parameters.max_particles = 700;
  parameters.lifetime = 0.5;
  parameters.open_sides = kOpenLowX | kOpenHighY;
  parameters.domain = Box(Vec3(-0.02, -0.02, 0.3), Vec3(0.02, 0.02, 0.36));
  parameters.background_leak = 1e-5;
  parameters.deposition_velocity = 1e-3;
  const SmokeObstacle tool = {.from = Vec3(0.0, 0.002, 0.31),
                              .to = Vec3(0.0, 0.002, 0.34),
                              .from_before = Vec3(0.0, 0.002, 0.31),
                              .to_before = Vec3(0.0, 0.002, 0.34),
                              .radius = 3e-3};
  const std::vector<SmokeOutlet> outlets = {
      {.position = Vec3(0.0, -0.005, 0.33), .radius = 2e-3, .flow = 2e-4},
      {.position = Vec3(0.0, 0.004, 0.35), .radius = 3e-3, .flow = 1e-5, .leak = true}};
  SmokeVolume smoke(parameters);
  for (int frame = 0; frame < 180; ++frame) {
    SmokeEmission emission = plume_source(frame < 60 ? 40 : 7);
    if (frame % 10 == 9) emission.position.z() = 0.2;  // outside: refused
    EXPECT_EQ(smoke.emit(emission), frame % 10 != 9);
    smoke.step(1.0 / 60.0, {.obstacles = {&tool, 1}, .outlets = outlets});
    const SmokeCounters& counters = smoke.counters();
    ASSERT_EQ(counters.emitted, smoke.particles().size() + counters.retired);
    ASSERT_NEAR(smoke.airborne(), smoke.book().owed_airborne(), 1e-12 * smoke.book().emitted);
    ASSERT_LE(smoke.particles().size(), parameters.max_particles);
  }
  const SmokeBook& book = smoke.book();
  EXPECT_NEAR(book.emitted, (54 * 40 + 108 * 7) * 1e-8, 1e-12);
  EXPECT_EQ(smoke.counters().refused, 18u);
  for (const double part : {book.background, book.evacuated, book.leaked, book.deposited}) {
    EXPECT_GT(part, 1e-4 * book.emitted);
  }
}

TEST(Smoke, AVolumeWithoutParticlesStillThinsItsBackground) {
  SmokeParameters parameters = cavity();
  parameters.lifetime = 0.1;
  parameters.cavity_volume = 2e-3;
  SmokeVolume smoke(parameters);
  smoke.emit(plume_source(10));
  for (int i = 0; i < 10; ++i) smoke.step(0.02);
  ASSERT_EQ(smoke.particles().size(), 0u);
  const double before = smoke.book().background;
  EXPECT_NEAR(before, 1e-7, 1e-13);
  const SmokeOutlet suction = {.flow = 5e-5};
  for (int i = 0; i < 40; ++i) smoke.step(1.0, {.outlets = {&suction, 1}});
  EXPECT_NEAR(smoke.book().background, before * std::exp(-1.0), 1e-9 * before);
  EXPECT_NEAR(smoke.book().evacuated, before * (1.0 - std::exp(-1.0)), 1e-9 * before);
}

TEST(Smoke, TheOldestRetireFirst) {
  SmokeParameters parameters = cavity();
  parameters.max_particles = 100;
  SmokeVolume smoke(parameters);
  for (int i = 0; i < 5; ++i) {
    smoke.emit(plume_source(30));
    smoke.step(1.0 / 60.0);
  }
  EXPECT_EQ(smoke.particles().size(), 100u);
  EXPECT_EQ(smoke.counters().retired, 50u);
  EXPECT_EQ(smoke.counters().crowded_out, 50u);
  for (const std::uint32_t id : smoke.particles().ids) EXPECT_GE(id, 50u);
}

TEST(Smoke, WallsKeepParticlesInside) {
  SmokeParameters parameters = cavity();
  parameters.domain = Box(Vec3::Zero(), Vec3(0.02, 0.02, 0.02));
  SmokeVolume smoke(parameters);
  for (int frame = 0; frame < 120; ++frame) {
    SmokeEmission emission = plume_source(10);
    emission.position = Vec3(0.01, 0.01, 0.001);
    emission.speed = 3.0;
    smoke.emit(emission);
    smoke.step(1.0 / 60.0);
    for (const Float4& position : smoke.particles().positions) {
      const Vec3f at = position.xyz();
      ASSERT_TRUE(at.minCoeff() >= 0.0f && at.maxCoeff() <= 0.02f) << at.transpose();
    }
  }
  EXPECT_EQ(smoke.particles().size(), 1200u);
}

TEST(Smoke, LoneParticlesFeelNoNeighboursAndAreCounted) {
  SmokeVolume smoke(pairs_only());
  for (int i = 0; i < 4; ++i) {
    emit_one(smoke, Vec3(1e-4 * i, 0.0, 0.4), 0.01 * i * Vec3::UnitX());
  }
  smoke.step(1.0 / 60.0);
  EXPECT_EQ(smoke.counters().isolated, 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(smoke.particles().velocity(i).x(), 0.01f * smoke.particles().ids[i]);
  }
  emit_one(smoke, Vec3(5e-4, 0.0, 0.4), Vec3::Zero());
  smoke.step(1e-4);
  EXPECT_EQ(smoke.counters().isolated, 0u);
}

TEST(Smoke, StaysBoundedForAnyStepViscosityAndCrowd) {
  for (const Laplacian laplacian : {Laplacian::kPairwise, Laplacian::kPaper}) {
    for (const double dt : {1e-4, 1.0 / 60.0, 1.0}) {
      SmokeParameters parameters = cavity();
      parameters.laplacian = laplacian;
      parameters.eddy_viscosity = 3e-5;
      SmokeVolume smoke(parameters);
      SmokeEmission emission = plume_source(120);
      emission.radius = 1e-4;
      smoke.emit(emission);
      emission.radius = 3e-3;
      smoke.emit(emission);
      for (int i = 0; i < (dt < 0.05 ? 30 : 2); ++i) smoke.step(dt);
      for (const Float4& velocity : smoke.particles().velocities) {
        ASSERT_TRUE(velocity.xyz().allFinite()) << dt;
        ASSERT_LT(velocity.xyz().norm(), 2.0f) << dt;
      }
    }
  }
}

TEST(Smoke, ViscosityAloneNeverMakesEnergyHoweverParticlesClump) {
  SmokeParameters parameters = pairs_only();
  parameters.crowding_speed = 0.0;
  SmokeVolume smoke(parameters);
  const Random random(8, 0);
  for (int i = 0; i < 600; ++i) {
    // From all in one place to one in a support radius.
    const Vec3 at = Vec3(0.0, 0.0, 0.4) +
                    6e-3 * std::pow(random.uniform(9 * i), 4.0) * Random(9, 0).direction(i);
    emit_one(smoke, at, 1e-3 * Vec3(random.normal(9 * i + 1), random.normal(9 * i + 2), 0.1));
  }
  const auto energy = [&] {
    double sum = 0.0;
    for (const Float4& v : smoke.particles().velocities) {
      sum += v.xyz().cast<double>().squaredNorm();
    }
    return sum;
  };
  double before = energy();
  for (const double dt : {1e-4, 1e-2, 0.018, 0.018, 0.05, 0.3, 1.0}) {
    smoke.step(dt);
    const double after = energy();
    EXPECT_LE(after, before * (1.0 + 1e-6)) << dt;
    before = after;
  }
}

TEST(Smoke, UnusableEmissionsAreRefusedAndStepsThatAreNoneDoNothing) {
  SmokeVolume smoke(cavity());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  std::uint64_t refused = 0;
  const auto refuse = [&](const auto& spoil) {
    SmokeEmission emission = plume_source(10);
    spoil(emission);
    EXPECT_FALSE(smoke.emit(emission));
    EXPECT_EQ(smoke.counters().refused, ++refused);
  };
  refuse([](SmokeEmission& e) { e.mass = 0.0; });
  refuse([&](SmokeEmission& e) { e.mass = infinite; });
  refuse([&](SmokeEmission& e) { e.position.x() = nan; });
  refuse([](SmokeEmission& e) { e.position.x() = 0.11; });
  refuse([](SmokeEmission& e) { e.direction.setZero(); });
  refuse([](SmokeEmission& e) { e.particles = -3; });
  refuse([](SmokeEmission& e) { e.radius = -1e-3; });
  refuse([&](SmokeEmission& e) { e.speed = nan; });
  refuse([&](SmokeEmission& e) { e.temperature = infinite; });
  refuse([](SmokeEmission& e) { e.duration = -1.0; });
  smoke.step(nan);
  smoke.step(-1.0);
  EXPECT_EQ(smoke.counters().emitted, 0u);
  EXPECT_EQ(smoke.book().emitted, 0.0);
  EXPECT_EQ(smoke.time(), 0.0);
  smoke.step(0.1);
  EXPECT_EQ(smoke.time(), 0.1);
}

}  // namespace
}  // namespace viscera
