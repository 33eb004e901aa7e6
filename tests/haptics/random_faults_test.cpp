// A million ticks in which anything may go wrong; ten million with VISCERA_FAULT_TOOLS=4000.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "kernels/base/random.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kHuge = std::numeric_limits<double>::max();
constexpr std::uint64_t kTools = 400, kTicks = 2500, kRare = 300;

std::uint64_t tools() {
  const char* asked = std::getenv("VISCERA_FAULT_TOOLS");
  return asked ? std::strtoull(asked, nullptr, 10) : kTools;
}

/// Once in kRare ticks, one of `kinds` faults; else -1.
int fault_at(const Random& random, std::uint64_t tick, std::uint64_t kinds) {
  const std::uint64_t bits = random.bits(tick);
  return bits % kRare == 0 ? static_cast<int>((bits >> 32) % kinds) : -1;
}

class FaultyWall : public VirtualWall {
 public:
  explicit FaultyWall(const Random& random) : random_(random) {}
  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    TactileForce felt = VirtualWall::respond(motion, dt);
    switch (fault_at(random_, motion.tick, 9)) {
      case 0:
        felt.force.y() = kNaN;
        break;
      case 1:
        felt.stiffness(1, 2) = -kNaN;
        break;
      case 2:
        felt.energy = kNaN;
        break;
      case 3:
        felt.supplied = kHuge;
        break;
      case 4:
        felt.force = Vec3::Constant(kHuge);
        break;
      case 5:
        felt.stiffness *= -1e300;
        break;
      case 6:
        felt.energy = kHuge;
        break;
      case 7:
        felt.stiffness = Mat3::Constant(-4000.0);
        break;
      case 8:
        felt.force *= -100.0;
        break;
      default:
        break;
    }
    return felt;
  }

 private:
  Random random_;
};

void break_reading(const Random& random, DeviceState& state, std::uint64_t tick) {
  switch (fault_at(random, tick, 7)) {
    case 0:
      state.pose.position.x() = kNaN;
      break;
    case 1:
      state.pose.orientation.coeffs().setConstant(kNaN);
      break;
    case 2:
      state.pose.position.z() -= 0.04;
      break;
    case 3:
      state.connected = false;
      break;
    case 4:
      state.pose.position.y() = kHuge;
      break;
    case 5:
      state.sample -= 1;
      break;
    case 6:
      state.pose.orientation.coeffs().setZero();
      break;
    default:
      break;
  }
}

TEST(RandomFaults, NoForceIsEverMoreThanItsLimitOrNoNumberAndEachLoopEnds) {
  std::uint64_t ran = 0, faults = 0;
  for (std::uint64_t tool = 0; tool < tools(); ++tool) {
    const Random random(77, tool), of_tissue(78, tool), of_device(79, tool), of_ticks(80, tool);
    const auto between = [&](std::uint64_t i, double low, double high) {
      return low * std::pow(high / low, random.uniform(i));
    };
    SimulatedDeviceSettings settings;
    settings.hand = Hand::with_grip(random.uniform(0));
    settings.limits.peak_force = between(1, 1.0, 20.0);
    settings.limits.continuous_force = settings.limits.peak_force * between(2, 0.1, 1.0);
    std::vector<std::pair<double, double>> keys;
    for (std::uint64_t i = 0; i < 12; ++i)
      keys.emplace_back(0.1 + 0.2 * static_cast<double>(i), 0.03 * (random.uniform(10 + i) - 0.6));
    settings.path = path_along_z(keys);
    SimulatedDevice inner(settings);
    WatchedDevice device(inner, [&](DeviceState& state, std::uint64_t tick) {
      break_reading(of_device, state, tick);
    });
    FaultyWall wall(of_tissue);
    wall.stiffness = between(3, 50.0, 1e6);
    wall.damping = between(4, 0.01, 10.0);
    ServoSettings servo_settings;
    servo_settings.guard.settle_time = 0.02;
    servo_settings.guard.engage_time = between(5, 0.01, 0.2);
    servo_settings.force.heat_time = between(6, 0.1, 10.0);
    servo_settings.placement.orientation =
        Quaternion(random.normal(30), random.normal(31), random.normal(32), random.normal(33))
            .normalized();
    wall.normal = servo_settings.placement.direction_to_world(Vec3::UnitZ());
    ServoTick servo(device, wall, servo_settings);

    std::uint64_t tick = 0;
    for (std::uint64_t i = 0; i < kTicks; ++i) {
      const ServoOutput& out = servo.run(tick);
      ASSERT_TRUE(out.force.allFinite() && out.tool.position.allFinite() &&
                  std::isfinite(out.damping) && std::isfinite(servo.energy_given()))
          << "tool " << tool << ", tick " << tick;
      ++ran;
      // Some, sometimes so many that it is a fault.
      const int skipped = fault_at(of_ticks, i, 60);
      tick += skipped < 0 ? 1 : 1 + static_cast<std::uint64_t>(skipped);
      if (i % 100 == 0) faults += take_events(servo.events()).size();
    }
    servo.release();
    for (int i = 0; i < 100; ++i, ++ran) servo.run(tick++);
    ASSERT_TRUE(servo.released()) << tool;
    ASSERT_EQ(servo.output().force, Vec3::Zero()) << tool;
    ASSERT_EQ(device.last, 0.0) << tool;
    ASSERT_EQ(device.not_finite, 0u) << tool;
    ASSERT_LE(device.greatest, settings.limits.peak_force * (1.0 + 1e-9)) << tool;
    ASSERT_GT(device.greatest, 0.0) << tool;
  }
  EXPECT_GE(ran, tools() * kTicks);
  EXPECT_GT(faults, 10 * tools());
}

}  // namespace
}  // namespace viscera::test
