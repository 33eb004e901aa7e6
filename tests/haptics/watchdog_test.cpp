// What becomes of the force when the loop's own thread fails. Where a test looks at a clock, its
// bound is far from what is promised: it tells an end from none, on any machine.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <limits>
#include <thread>

#include "haptics/servo_loop.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

ServoLoopSettings gentle() {
  ServoLoopSettings settings;
  settings.priority = 0;
  settings.lock_memory = false;
  return settings;
}

SimulatedDeviceSettings pressing() {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.1, 0.01}, {0.3, -0.01}});
  return settings;
}

/// False: it didn't come true for ever so long.
template <class Condition>
bool comes_true(Condition condition) {
  const auto end = Clock::now() + 20s;
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

/// Something to be stuck in.
struct Gate {
  std::atomic<bool> closed{false}, waited{false};
  void pass() {
    while (closed) {
      waited = true;
      std::this_thread::sleep_for(1ms);
    }
  }
};

class BlockingWall : public VirtualWall {
 public:
  explicit BlockingWall(Gate& gate) : gate_(gate) { stiffness = 500.0; }
  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    gate_.pass();
    return VirtualWall::respond(motion, dt);
  }

 private:
  Gate& gate_;
};

TEST(DevicePen, ATickThatComesAfterTheWatchdogWritesNothingButZero) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  DevicePen pen(device);
  EXPECT_TRUE(pen.write(Vec3(2.0, 0.0, 0.0)));
  ASSERT_TRUE(pen.take());
  EXPECT_FALSE(pen.take());
  EXPECT_FALSE(pen.write(Vec3(3.0, 0.0, 0.0)));
  EXPECT_EQ(device.last, 2.0);
  pen.fade_to(0.5);
  EXPECT_EQ(device.last, 1.0);
  pen.let_go();
  EXPECT_EQ(device.last, 0.0);
  EXPECT_FALSE(pen.take()) << "it was let go of already";
  EXPECT_FALSE(pen.write(Vec3(3.0, 0.0, 0.0)));
  EXPECT_EQ(device.last, 0.0);
  EXPECT_TRUE(pen.write(Vec3(1.0, 0.0, 0.0)));
  EXPECT_EQ(device.last, 1.0);
}

TEST(DevicePen, TwoThreadsAreNeverInADevicesWriteAtOnce) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  DevicePen pen(device);
  std::atomic<bool> end{false};
  std::atomic<std::uint64_t> taken{0};
  std::thread watchdog([&] {
    while (!end) {
      if (!pen.take()) continue;
      ++taken;
      pen.fade_to(0.5);
      pen.let_go();
    }
  });
  std::uint64_t written = 0;
  const auto until = Clock::now() + 300ms;
  while (Clock::now() < until || taken == 0) written += pen.write(Vec3(1.0, 0.0, 0.0));
  end = true;
  watchdog.join();
  EXPECT_GT(written, 0u);
  EXPECT_EQ(device.together, 0u);
}

/// A loop whose ticks can be held up, in the device's read() (true) or in the tissue.
class Watchdog : public testing::TestWithParam<bool> {
 protected:
  Watchdog() { loop.start(); }
  ~Watchdog() override { gate.closed = false; }

  Gate gate, open;
  SimulatedDevice inner{pressing()};
  WatchedDevice device{inner, [this](DeviceState&, std::uint64_t) {
                         if (GetParam()) gate.pass();
                       }};
  BlockingWall wall{GetParam() ? open : gate};
  ServoTick tick{device, wall, {}};
  ServoLoop loop{tick, gentle()};
};

TEST_P(Watchdog, ForceFadesWhereATickDoesNotEndAndComesBackAsAfterAFault) {
  const auto shown = [&] {
    loop.outputs().update();
    return loop.outputs().front();
  };
  ASSERT_TRUE(comes_true([&] { return shown().authority == 1.0 && shown().force.norm() > 1.0; }));
  gate.closed = true;
  ASSERT_TRUE(comes_true([&] { return gate.waited.load(); }));
  const double held = device.last;
  device.greatest_rise = 0.0;
  const std::uint64_t falls = device.falls;
  ASSERT_TRUE(comes_true([&] { return device.last == 0.0; })) << "nobody else can take it away";
  EXPECT_GT(held, 0.5);
  EXPECT_GT(device.falls, falls) << "by and by";
  ASSERT_TRUE(comes_true(
      [&] { return has_event(take_events(loop.watchdog_events()), ServoEventKind::kWatchdog); }));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(device.last, 0.0);

  take_events(loop.events());
  gate.closed = false;
  ASSERT_TRUE(comes_true([&] { return device.last > 0.5 * held; }));
  EXPECT_LT(device.greatest_rise, 0.2 * held);
  const auto events = take_events(loop.events());
  EXPECT_TRUE(has_event(events, ServoEventKind::kTicksMissing));
  EXPECT_TRUE(has_event(events, ServoEventKind::kEngaged));
  EXPECT_TRUE(loop.stop());
  EXPECT_EQ(device.together, 0u);
}

TEST_P(Watchdog, StopReturnsWhereATickIsStuckAndSaysSo) {
  ASSERT_TRUE(comes_true([&] { return device.last > 1.0; }));
  gate.closed = true;
  ASSERT_TRUE(comes_true([&] { return gate.waited.load(); }));
  EXPECT_FALSE(loop.stop());
  EXPECT_TRUE(comes_true([&] { return device.last == 0.0; }));
  EXPECT_TRUE(comes_true(
      [&] { return has_event(take_events(loop.watchdog_events()), ServoEventKind::kTickStuck); }));
  gate.closed = false;
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  EXPECT_EQ(device.last, 0.0);
}

INSTANTIATE_TEST_SUITE_P(Haptics, Watchdog, testing::Bool(), [](const auto& info) {
  return info.param ? std::string("InRead") : std::string("InTissue");
});

TEST(ServoLoopEnd, AForceThatDoesNotFadeIsTakenAwayAndZeroIsWrittenLast) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  VirtualWall wall = wall_at_zero(500.0);
  ServoSettings settings;
  settings.guard.fade_time = 1e9;
  ServoTick tick(device, wall, settings);
  ServoLoop loop(tick, gentle());
  loop.start();
  ASSERT_TRUE(comes_true([&] { return device.last > 1.0; }));
  const auto began = Clock::now();
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  EXPECT_LT(Clock::now() - began, 5s);
  EXPECT_EQ(device.last, 0.0);
  EXPECT_EQ(tick.output().force, Vec3::Zero());
}

TEST(ServoLoopEnd, ForcesThatAreNoNumbersDoNotKeepItFromEnding) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  device.limits_.friction = std::numeric_limits<double>::quiet_NaN();
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  ASSERT_TRUE(comes_true([&] { return loop.statistics().ticks > 500; }));
  const auto began = Clock::now();
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  EXPECT_LT(Clock::now() - began, 5s);
  EXPECT_EQ(device.not_finite, 0u);
  EXPECT_EQ(device.last, 0.0);
}

TEST(ServoLoopEnd, ZeroIsWrittenLastWhereNothingIsWrong) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  ASSERT_TRUE(comes_true([&] { return device.last > 1.0; }));
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  EXPECT_EQ(device.last, 0.0);
  EXPECT_TRUE(take_events(loop.watchdog_events()).empty());
}

TEST(ServoLoop, TicksThatAreAlwaysLateRestAndSaySoOnce) {
  class Busy : public VirtualWall {
   public:
    TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
      rusage usage{};
      getrusage(RUSAGE_THREAD, &usage);
      gave_away = static_cast<std::uint64_t>(usage.ru_nvcsw);
      const auto until = Clock::now() + 1500us;
      while (Clock::now() < until) {
      }
      return VirtualWall::respond(motion, dt);
    }
    std::atomic<std::uint64_t> gave_away{0};  // the processor, of its own will
  } wall;
  SimulatedDevice device(pressing());
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  ASSERT_TRUE(comes_true([&] { return loop.statistics().rests > 0; }));
  const std::uint64_t before = wall.gave_away;
  const std::uint64_t ticks = loop.statistics().ticks;
  ASSERT_TRUE(comes_true([&] { return loop.statistics().ticks > ticks + 100; }));
  EXPECT_GT(wall.gave_away, before + 50);
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  int told = 0;
  for (const ServoEvent& event : take_events(loop.events()))
    told += event.kind == ServoEventKind::kAlwaysLate;
  EXPECT_EQ(told, 1);
}

}  // namespace
}  // namespace viscera::test
