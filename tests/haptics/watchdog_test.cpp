// What becomes of the force when the loop's own thread fails. Where a test looks at a clock, its
// bound is far from what is promised: it tells an end from none, on any machine.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <functional>
#include <limits>
#include <thread>

#include "haptics/servo_loop.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

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
  std::function<bool()> waits;  ///< asked by who finds it closed, before it waits; false: it passes
  void pass() {
    if (!closed || (waits && !waits())) return;
    waited = true;
    while (closed) std::this_thread::sleep_for(1ms);
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
  SimulatedDevice inner(pressing_soon());
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
  SimulatedDevice inner(pressing_soon());
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
  while (Clock::now() < until || taken == 0 || written == 0)
    written += pen.write(Vec3(1.0, 0.0, 0.0));
  end = true;
  watchdog.join();
  EXPECT_GT(written, 0u);
  EXPECT_EQ(device.together, 0u);
}

/// A loop whose ticks can be held up, in the device's read() (true) or in the tissue.
class Watchdog : public testing::TestWithParam<bool> {
 protected:
  Watchdog() {
    // Only a tick that holds some force gets stuck, and what it holds is noted by its own thread:
    // the test's may be away until the force is gone.
    gate.waits = [this] {
      if (device.last < 1.0) return false;
      held = device.last.load();
      falls = device.falls.load();
      device.greatest_rise = 0.0;
      return true;
    };
    loop.start();
  }
  ~Watchdog() override { gate.closed = false; }

  Gate gate, open;
  std::atomic<double> held{0.0};  ///< [N] by the device when its tick got stuck
  std::atomic<std::uint64_t> falls{0};
  SimulatedDevice inner{pressing_soon()};
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
  // A watchdog that is away for as long as its fade lasts takes the force at once: then again.
  bool by_and_by = false;
  for (int i = 0; i < 20 && !by_and_by; ++i) {
    ASSERT_TRUE(comes_true([&] { return shown().authority == 1.0 && shown().force.norm() > 1.0; }));
    take_events(loop.events());
    gate.waited = false;
    gate.closed = true;
    ASSERT_TRUE(comes_true([&] { return gate.waited.load(); }));
    ASSERT_TRUE(comes_true([&] { return device.last == 0.0; })) << "nobody else can take it away";
    by_and_by = device.falls > falls;
    ASSERT_TRUE(comes_true(
        [&] { return has_event(take_events(loop.watchdog_events()), ServoEventKind::kWatchdog); }));
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(device.last, 0.0);

    gate.closed = false;
    ASSERT_TRUE(comes_true([&] { return device.last > 0.5 * held; }));
    EXPECT_LT(device.greatest_rise, 0.2 * held);
    const auto events = take_events(loop.events());
    EXPECT_TRUE(has_event(events, ServoEventKind::kTicksMissing));
    EXPECT_TRUE(has_event(events, ServoEventKind::kEngaged));
  }
  EXPECT_TRUE(by_and_by);
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
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
  SimulatedDevice inner(pressing_soon());
  WatchedDevice device(inner);
  VirtualWall wall = wall_at_zero(500.0);
  ServoSettings settings = patient();
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
  SimulatedDevice inner(pressing_soon());
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
  SimulatedDevice inner(pressing_soon());
  WatchedDevice device(inner);
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, patient());
  ServoLoop loop(tick, gentle());
  loop.start();
  ASSERT_TRUE(comes_true([&] { return device.last > 1.0; }));
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  EXPECT_EQ(device.last, 0.0);
  EXPECT_FALSE(has_event(take_events(loop.watchdog_events()), ServoEventKind::kWatchdog));
}

TEST(ServoLoop, TicksThatAreAlwaysLateRestAndSaySoOnce) {
  class Busy : public VirtualWall {
   public:
    TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
      rusage usage{};
      getrusage(RUSAGE_THREAD, &usage);
      gave_away = static_cast<std::uint64_t>(usage.ru_nvcsw);
      ++asked;
      const auto until = Clock::now() + 1500us;
      while (Clock::now() < until) {
      }
      return VirtualWall::respond(motion, dt);
    }
    std::atomic<std::uint64_t> asked{0};
    std::atomic<std::uint64_t> gave_away{0};  // the processor, of its own will
  } wall;
  SimulatedDevice device(pressing_soon());
  ServoTick tick(device, wall, patient());
  ServoLoop loop(tick, gentle());
  loop.start();
  ASSERT_TRUE(comes_true([&] { return loop.statistics().rests > 0; }));
  const std::uint64_t before = wall.gave_away, asked = wall.asked;
  ASSERT_TRUE(comes_true([&] { return wall.asked > asked + 100; }));
  EXPECT_GT(wall.gave_away, before + 50);
  EXPECT_TRUE(comes_true([&] { return loop.stop(); }));
  int told = 0;
  for (const ServoEvent& event : take_events(loop.events()))
    told += event.kind == ServoEventKind::kAlwaysLate;
  EXPECT_EQ(told, 1);
}

}  // namespace
}  // namespace viscera::test
