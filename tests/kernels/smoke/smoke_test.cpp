#include "kernels/smoke/smoke.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <string>

#include "kernels/base/hash.h"
#include "kernels/base/random.h"

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
  parameters.random_acceleration = 0.0;
  parameters.swirl_acceleration = 0.0;
  parameters.gravity = 0.0;
  parameters.surrounding_drag = 0.0;
  parameters.entrainment = 0.0;
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

double airborne(const SmokeVolume& smoke) {
  return std::accumulate(smoke.particles().masses.begin(), smoke.particles().masses.end(), 0.0);
}

std::string state_hash(const SmokeVolume& smoke) {
  const SmokeParticles& p = smoke.particles();
  Hasher hasher;
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      hasher.value(p.positions[i][axis]).value(p.velocities[i][axis]);
    }
  }
  hasher.array(std::span(p.temperatures)).array(std::span(p.masses)).array(std::span(p.ids));
  return hasher.hex();
}

Vec3 momentum(const SmokeVolume& smoke) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3f& velocity : smoke.particles().velocities) sum += velocity.cast<double>();
  return sum;
}

TEST(Smoke, HashIsTheSameForOneAndTwoThreads) {
  const auto run = [](int threads) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    SmokeVolume smoke(cavity());
    for (int frame = 0; frame < 90; ++frame) {
      smoke.emit(plume_source(40));
      smoke.step(1.0 / 60.0);
    }
    SmokeGrid grid;
    splat(smoke, 2e-3, grid);
    return state_hash(smoke) + Hasher().array(std::span<const float>(grid.density)).hex();
  };
  const std::string one = run(1);
  EXPECT_EQ(one, run(2));
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
    for (const Vec3f& v : smoke.particles().velocities) {
      sum += (v.cast<double>() - mean).squaredNorm();
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

// v_x = sin(k z) in an infinite gas decays at the rate nu k^2. Measured in the middle of a block.
TEST(Smoke, ShearWaveDecaysAtTheExactRate) {
  SmokeParameters parameters = pairs_only();
  parameters.crowding_speed = 0.0;
  parameters.max_particles = 100000;
  const double spacing = parameters.spacing / 2.5;
  const double wavelength = 20e-3;
  const double k = 2.0 * std::numbers::pi / wavelength;
  SmokeVolume smoke(parameters);
  const Random random(3, 0);
  std::uint64_t draw = 0;
  const Vec3 centre = parameters.domain.center();
  for (int z = -14; z <= 14; ++z) {
    for (int y = -8; y <= 8; ++y) {
      for (int x = -8; x <= 8; ++x) {
        Vec3 offset = spacing * Vec3(x, y, z);
        for (int axis = 0; axis < 3; ++axis) offset[axis] += 0.15 * spacing * random.normal(draw++);
        emit_one(smoke, centre + offset, 0.01 * std::sin(k * offset.z()) * Vec3::UnitX());
      }
    }
  }
  // The amplitude by least squares over the particles a support radius and more inside.
  const auto amplitude = [&] {
    double top = 0.0, bottom = 0.0;
    for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
      const Vec3 at =
          smoke.particles().positions[i].cast<double>() + parameters.domain.min() - centre;
      if (std::abs(at.x()) > 5e-3 || std::abs(at.y()) > 5e-3 || std::abs(at.z()) > 10e-3) continue;
      const double wave = std::sin(k * at.z());
      top += wave * smoke.particles().velocities[i].x();
      bottom += wave * wave;
    }
    return top / bottom;
  };
  const double before = amplitude();
  const double time = 0.1;
  for (int i = 0; i < 20; ++i) smoke.step(time / 20.0);
  const double rate = std::log(before / amplitude()) / time;
  const double nu = parameters.gas_viscosity / parameters.gas_density + parameters.eddy_viscosity;
  RecordProperty("relative_error", std::to_string(rate / (nu * k * k) - 1.0));
  EXPECT_NEAR(rate, nu * k * k, 0.08 * nu * k * k);
}

TEST(Smoke, PlumeRisesAtADecimetreASecondAndSpreads) {
  SmokeVolume smoke(cavity());
  for (int frame = 0; frame < 180; ++frame) {
    smoke.emit(plume_source(20));
    smoke.step(1.0 / 60.0);
  }
  double rise = 0.0;
  int young = 0;
  Eigen::AlignedBox3f bounds;
  for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
    bounds.extend(smoke.particles().positions[i]);
    const float age = smoke.particles().ages[i];
    if (age < 0.1f || age > 0.5f) continue;
    rise += smoke.particles().velocities[i].z();
    ++young;
  }
  EXPECT_GT(rise / young, 0.1);
  EXPECT_LT(rise / young, 0.3);
  EXPECT_GT(bounds.sizes().z(), 0.12f);
  EXPECT_GT(bounds.sizes().x(), 0.04f);
}

TEST(Smoke, DiffusionByTheWhiteForceDoesNotDependOnTheStep) {
  const auto spread = [](int steps_a_frame) {
    SmokeParameters parameters = cavity();
    parameters.swirl_acceleration = 0.0;
    parameters.gravity = 0.0;
    parameters.random_acceleration = 0.5;
    SmokeVolume smoke(parameters);
    // Far apart: no neighbours.
    for (int i = 0; i < 4000; ++i) {
      emit_one(smoke,
               parameters.domain.center() +
                   5e-3 * (Vec3(i % 16, i / 16 % 16, i / 256).array() - 7.5).matrix(),
               Vec3::Zero());
    }
    for (int i = 0; i < 60 * steps_a_frame; ++i) smoke.step(1.0 / 60.0 / steps_a_frame);
    double sum = 0.0;
    for (std::size_t i = 0; i < smoke.particles().size(); ++i) {
      const int id = static_cast<int>(smoke.particles().ids[i]);
      const Vec3 start = 5e-3 * (Vec3(id % 16, id / 16 % 16, id / 256).array() - 7.5).matrix() +
                         parameters.domain.sizes() / 2.0;
      sum += (smoke.particles().positions[i].cast<double>() - start).squaredNorm();
    }
    return sum / 4000.0;
  };
  const double coarse = spread(1);
  EXPECT_GT(coarse, 1e-6);
  EXPECT_NEAR(spread(4), coarse, 0.15 * coarse);
}

TEST(Smoke, MassIsBooked) {
  SmokeParameters parameters = cavity();
  parameters.max_particles = 700;
  parameters.lifetime = 0.5;
  SmokeVolume smoke(parameters);
  for (int frame = 0; frame < 120; ++frame) {
    SmokeEmission emission = plume_source(frame < 60 ? 40 : 7);
    if (frame % 10 == 9) emission.position.z() = 0.2;
    smoke.emit(emission);
    smoke.step(1.0 / 60.0);
    const SmokeCounters& counters = smoke.counters();
    ASSERT_EQ(counters.emitted, smoke.particles().size() + counters.left_domain + counters.retired);
    ASSERT_NEAR(counters.emitted_mass, airborne(smoke) + counters.left_mass + counters.retired_mass,
                1e-12 * counters.emitted_mass);
    ASSERT_LE(smoke.particles().size(), parameters.max_particles);
  }
  EXPECT_NEAR(smoke.counters().emitted_mass, (60 * 40 + 60 * 7) * 1e-8, 1e-12);
  EXPECT_GT(smoke.counters().left_domain, 0u);
  EXPECT_GT(smoke.counters().retired, 0u);
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
    for (const Vec3f& at : smoke.particles().positions) {
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
    EXPECT_EQ(smoke.particles().velocities[i].x(), 0.01f * smoke.particles().ids[i]);
  }
  emit_one(smoke, Vec3(5e-4, 0.0, 0.4), Vec3::Zero());
  smoke.step(1e-4);
  EXPECT_EQ(smoke.counters().isolated, 0u);
}

TEST(Smoke, StaysBoundedForHugeStepsViscosityAndCrowds) {
  SmokeParameters parameters = cavity();
  parameters.eddy_viscosity = 1e-4;
  SmokeVolume smoke(parameters);
  SmokeEmission emission = plume_source(1000);
  emission.radius = 1e-4;
  smoke.emit(emission);
  for (int i = 0; i < 5; ++i) smoke.step(0.2);
  for (const Vec3f& velocity : smoke.particles().velocities) {
    ASSERT_TRUE(velocity.allFinite());
    ASSERT_LT(velocity.norm(), 2.0f);
  }
}

TEST(Smoke, UnusableEmissionsAndStepsDoNothing) {
  SmokeVolume smoke(cavity());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SmokeEmission emission = plume_source(10);
  emission.mass = 0.0;
  smoke.emit(emission);
  emission = plume_source(10);
  emission.position.x() = nan;
  smoke.emit(emission);
  emission = plume_source(10);
  emission.direction.setZero();
  smoke.emit(emission);
  emission = plume_source(-3);
  emission.mass = 1e-8;
  smoke.emit(emission);
  smoke.step(nan);
  smoke.step(-1.0);
  EXPECT_EQ(smoke.counters().emitted, 0u);
  EXPECT_EQ(smoke.time(), 0.0);
  smoke.step(0.1);
  EXPECT_EQ(smoke.time(), 0.1);
}

}  // namespace
}  // namespace viscera
