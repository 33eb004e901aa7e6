// The loop as a thread. No test here says how long something takes: they count ticks.
#include "haptics/servo_loop.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/haptics/servo_world.h"

namespace viscera::test {
namespace {

using namespace std::chrono_literals;

void wait_for_ticks(const ServoLoop& loop, std::uint64_t ticks) {
  while (loop.statistics().ticks < ticks) std::this_thread::sleep_for(1ms);
}

TEST(ServoLoop, ItTicksItsDeviceAndLetsGoBeforeItEnds) {
  SimulatedDevice device(pressing_soon());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  wait_for_ticks(loop, 600);
  end(loop);
  EXPECT_EQ(tick.output().force, Vec3::Zero());
  const auto events = take_events(loop.events());
  EXPECT_TRUE(has_event(events, ServoEventKind::kEngaged));
  EXPECT_TRUE(has_event(events, ServoEventKind::kReleased));
}

TEST(ServoLoop, EveryTickIsInEachHistogram) {
  SimulatedDevice device(pressing_soon());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  const auto loop = std::make_unique<ServoLoop>(tick, gentle());
  loop->start();
  wait_for_ticks(*loop, 50);
  end(*loop);
  const ServoStatistics& statistics = loop->statistics();
  EXPECT_EQ(statistics.compute.count(), statistics.ticks);
  EXPECT_EQ(statistics.lateness.count(), statistics.ticks);
  for (const LatencyHistogram& part : statistics.parts) EXPECT_EQ(part.count(), statistics.ticks);
  // Ticks that were missed have their numbers all the same.
  EXPECT_EQ(tick.output().tick, statistics.ticks + statistics.missed);
}

TEST(ServoLoop, ATickThatTakesTooLongIsCountedAndTheNextOnesKeepTheGrid) {
  class SlowAtTimes : public VirtualWall {
   public:
    TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
      if (++asked % 20 == 0) std::this_thread::sleep_for(5ms);
      return VirtualWall::respond(motion, dt);
    }
    int asked = 0;
  } wall;
  SimulatedDevice device(pressing_soon());
  ServoTick tick(device, wall, patient());
  ServoLoop loop(tick, gentle());
  loop.start();
  wait_for_ticks(loop, 300);
  end(loop);
  EXPECT_GE(loop.statistics().missed, 4u * 5u);
  EXPECT_GE(loop.statistics().parts[static_cast<std::size_t>(TickPart::kTissue)].max_ns(),
            5'000'000u);
}

TEST(ServoLoop, ItSaysHowItIsScheduled) {
  SimulatedDevice device(pressing_soon());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  EXPECT_EQ(loop.scheduler(),
            "SCHED_OTHER (SCHED_FIFO not asked for), memory not locked (not asked for)");
  ServoLoopSettings wanting = gentle();
  wanting.priority = 1;
  SimulatedDevice other_device(pressing_soon());
  ServoTick other_tick(other_device, wall, {});
  ServoLoop other(other_tick, wanting);
  other.start();
  EXPECT_TRUE(other.scheduler().starts_with("SCHED_FIFO 1") ||
              other.scheduler().starts_with("SCHED_OTHER (SCHED_FIFO refused: "))
      << other.scheduler();
}

TEST(ServoLoop, SeveralDevicesEachHaveTheirOwnLoop) {
  SimulatedDevice left(pressing_soon()), right(pressing_soon());
  VirtualWall soft = wall_at_zero(200.0), hard = wall_at_zero(1000.0);
  ServoTick left_tick(left, soft, {}), right_tick(right, hard, {});
  ServoLoop left_loop(left_tick, gentle()), right_loop(right_tick, gentle());
  left_loop.start();
  right_loop.start();
  const auto last_touch = [](ServoLoop& loop) {
    while (true) {
      loop.outputs().update();
      const ServoOutput& out = loop.outputs().front();
      if (out.tick > 600 && out.authority == 1.0) return out.force.z();
      std::this_thread::sleep_for(1ms);
    }
  };
  const double left_force = last_touch(left_loop), right_force = last_touch(right_loop);
  EXPECT_GT(left_force, 0.3);
  EXPECT_GT(right_force, left_force);
}

TEST(ServoLoop, AStoppedLoopStartsAgain) {
  SimulatedDevice device(pressing_soon());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  wait_for_ticks(loop, 10);
  end(loop);
  const std::uint64_t ticks = loop.statistics().ticks, last = tick.output().tick;
  loop.start();
  wait_for_ticks(loop, ticks + 10);
  end(loop);
  const std::uint64_t after = loop.statistics().ticks;
  EXPECT_GE(after, ticks + 10);
  EXPECT_GE(tick.output().tick, last + 10) << "ticks go on where they ended";
  EXPECT_TRUE(loop.stop()) << "a second time there is nothing to do";
  EXPECT_EQ(loop.statistics().ticks, after);
}

TEST(LockstepServo, ItRunsTheTicksThatAreDueOnce) {
  SimulatedDevice device(pressing_soon());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick tick(device, wall, {});
  LockstepServo lockstep(tick);
  // 60 frames a second of whole milliseconds.
  std::uint64_t ran = 0;
  for (std::uint64_t frame = 1; frame <= 60; ++frame) {
    const std::uint64_t before = lockstep.next();
    lockstep.advance_to(1000 * frame / 60);
    ran += lockstep.next() - before;
  }
  EXPECT_EQ(ran, 1000u);
  EXPECT_EQ(tick.output().tick, 999u);
}

/// A wall that a frame thread moves, as tissue's snapshots will be.
class SnapshotWall : public VirtualWall {
 public:
  TripleBuffer<double> height;  // [m]
  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    height.update();
    place.z() = height.front();
    return VirtualWall::respond(motion, dt);
  }
};

TEST(ServoLoop, AStalledFrameThreadIsNotFelt) {
  // The same path twice; in the second the frame thread publishes nothing for most of it.
  const auto forces = [](bool stalls) {
    SnapshotWall wall;
    wall.stiffness = 400.0;
    SimulatedDevice device(pressing_soon());
    ServoTick tick(device, wall, {});
    LockstepServo lockstep(tick);
    std::vector<Vec3> all;
    for (std::uint64_t frame = 1; frame <= 120; ++frame) {
      if (!stalls || frame < 20 || frame > 90) {
        wall.height.back() = 0.0;
        wall.height.publish();
      }
      while (lockstep.next() < 1000 * frame / 60) {
        lockstep.advance_to(lockstep.next() + 1);
        all.push_back(tick.output().force);
      }
    }
    return all;
  };
  EXPECT_EQ(forces(false), forces(true));
}

TEST(ServoLoop, FramesAndLoopExchangeWhileBothRun) {
  SnapshotWall wall;
  wall.stiffness = 400.0;
  SimulatedDevice device(pressing_soon());
  ServoTick tick(device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  std::uint64_t seen = 0, newest = 0;
  for (int frame = 0; frame < 200 || (seen == 0 && frame < 10'000); ++frame) {
    wall.height.back() = 1e-4 * (frame % 10);
    wall.height.publish();
    if (loop.outputs().update()) {
      const ServoOutput& out = loop.outputs().front();
      EXPECT_GT(out.tick, newest);
      newest = out.tick;
      ++seen;
    }
    std::this_thread::sleep_for(2ms);
  }
  EXPECT_GT(seen, 0u);
  end(loop);
}

}  // namespace
}  // namespace viscera::test
