// Whole servos by figures: what fades, what is damped, what is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "haptics/servo_loop.h"
#include "tests/haptics/servo_world.h"

namespace viscera::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(ServoTick, AFadingForceIsDampedAgainstTheMotionItPays) {
  // Outward at 5 cm/s under a push that nobody knows the source of: the budget is spent.
  SteadyDevice device(-0.02, 0.05);
  SteadyPush push(Vec3::UnitZ());
  ServoTick servo(device, push, {});
  run_ticks(servo, 0, 700);
  ASSERT_GT(servo.output().damping, 1.0);
  servo.release();
  for (std::uint64_t tick = 700; tick < 720; ++tick) {
    const ServoOutput& out = servo.run(tick);
    const double fading = out.authority * servo.state().fading.z();
    EXPECT_NEAR(out.force.z(), fading - 0.05 * out.damping, 1e-3) << tick;
    EXPECT_GT(out.damping, 1.0);
  }
}

TEST(ServoTick, OnceItsForceIsGoneADeviceIsNeitherDampedNorCounted) {
  SteadyDevice device(-0.02, 0.02);
  SteadyPush push(Vec3::UnitZ());
  ServoSettings settings;
  settings.passivity.control = false;
  ServoTick servo(device, push, settings);
  run_ticks(servo, 0, 1000);
  EXPECT_GT(servo.passivity_violations(), 100u);
  servo.release();
  run_ticks(servo, 1000, 1100);
  ASSERT_TRUE(servo.released());
  ASSERT_EQ(servo.output().force, Vec3::Zero());
  const std::uint64_t counted = servo.passivity_violations();
  run_ticks(servo, 1100, 1200);
  EXPECT_EQ(servo.passivity_violations(), counted);
  EXPECT_EQ(servo.output().damping, 0.0);
}

TEST(ServoTick, OfASmallForceThatLimitsHalveHalfOfTheEnergyCounts) {
  SteadyDevice device(-0.01, 0.0);
  device.limits_.peak_force = device.limits_.continuous_force = 0.4;
  SteadyPush push(Vec3(0.0, 0.0, 0.8));
  ServoSettings settings;
  settings.passivity.control = false;
  ServoTick servo(device, push, settings);
  EXPECT_NEAR(run_ticks(servo, 0, 600).back().force.z(), 0.4, 1e-12);
  EXPECT_NEAR(servo.state().passivity.share, 0.5, 1e-9);
}

/// Takes so long for an answer, and knows when it was asked and when it had answered.
class SlowTissue : public TactileModel {
 public:
  explicit SlowTissue(std::chrono::milliseconds takes) : takes_(takes) {}
  TactileForce respond(const ToolMotion&, double) noexcept override {
    const Clock::time_point asked = Clock::now();
    if (answered_ != Clock::time_point() && asked - answered_ < shortest_pause.load())
      shortest_pause = asked - answered_;
    while (Clock::now() < asked + takes_) {
    }
    answered_ = Clock::now();
    return {};
  }
  void begin_anew() { shortest_pause = 1h; }
  std::atomic<Clock::duration> shortest_pause{1h};

 private:
  std::chrono::milliseconds takes_;
  Clock::time_point answered_;  // the tick's thread alone
};

TEST(ServoLoop, ARestIsAQuarterOfWhatTheTickTook) {
  // Ticks of 3 ms in periods of 2: rests of 0.75 ms.
  SlowTissue tissue(3ms);
  SimulatedDevice device(pressing_soon());
  ServoSettings settings = patient();
  settings.dt = 2e-3;
  settings.guard.settle_time = 2e-3;
  ServoTick tick(device, tissue, settings);
  ServoLoop loop(tick, gentle());
  loop.start();
  while (loop.statistics().rests < 2) std::this_thread::sleep_for(1ms);
  tissue.begin_anew();
  // A machine under load lengthens rests; it shortens none.
  const auto end_of_patience = Clock::now() + 20s;
  while (tissue.shortest_pause.load() >= 1400us && Clock::now() < end_of_patience)
    std::this_thread::sleep_for(1ms);
  EXPECT_LT(tissue.shortest_pause.load(), 1400us);
  end(loop);
  EXPECT_GE(tissue.shortest_pause.load(), 750us);
}

TEST(ServoLoop, ATicksTimeIsTheSumOfItsParts) {
  SlowTissue tissue(3ms);
  SimulatedDevice device(pressing_soon());
  ServoSettings settings = patient();
  settings.guard.settle_time = 1e-3;
  ServoTick tick(device, tissue, settings);
  ServoLoop loop(tick, gentle());
  loop.start();
  while (loop.statistics().ticks < 20) std::this_thread::sleep_for(1ms);
  end(loop);
  const ServoStatistics& statistics = loop.statistics();
  std::uint64_t most = 0;
  for (const LatencyHistogram& part : statistics.parts) most += part.max_ns();
  EXPECT_GE(statistics.compute.max_ns(), 3'000'000u);
  EXPECT_LE(statistics.compute.max_ns(), most);
}

}  // namespace
}  // namespace viscera::test
