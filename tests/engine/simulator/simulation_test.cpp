#include "engine/simulator/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <thread>

#include "engine/features/breathing/breathing.h"
#include "engine/features/coagulation/coagulation.h"
#include "engine/features/gas/gas.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/links/links.h"
#include "engine/features/smoke/smoke.h"
#include "tests/engine/simulator/busy_scene.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera {
namespace {

using testing::HasSubstr;

constexpr double kTop = 25e-3;  // pole of the ball [m]

Simulation busy_simulation() {
  auto made = Simulation::create(test::busy_model());
  EXPECT_TRUE(made) << made.error().text();
  return *std::move(made);
}

void step_to(Simulation& simulation, std::uint64_t frame) {
  while (simulation.frame() < frame) simulation.step();
}

TEST(Simulation, OfOneModelRepeatsItselfBitForBit) {
  Simulation one = busy_simulation(), other = busy_simulation();
  step_to(one, 40);
  step_to(other, 40);
  EXPECT_EQ(one.hash(), other.hash());
  EXPECT_EQ(one.world().state_difference(other.world()), "");
}

TEST(Simulation, GoesOnFromASnapshotToTheSameHashAtAnyMoment) {
  Simulation whole = busy_simulation();
  std::vector<Snapshot> snapshots;
  std::vector<std::string> hashes;
  for (const std::uint64_t frame : {0, 1, 7, 19, 31, 46, 60, 75}) {
    step_to(whole, frame);
    auto snapshot = whole.snapshot();
    ASSERT_TRUE(snapshot) << snapshot.error().text();
    snapshots.push_back(*snapshot);
    hashes.push_back(whole.hash());
  }
  step_to(whole, 90);
  const std::string end = whole.hash();
  Simulation other = busy_simulation();
  step_to(other, 52);  // it has lived another life
  for (const std::size_t i : {6, 2, 0, 4, 7, 1, 3, 5}) {
    ASSERT_TRUE(other.restore(snapshots[i]));
    EXPECT_EQ(other.hash(), hashes[i]) << i;
    step_to(other, 90);
    EXPECT_EQ(other.hash(), end) << "from frame " << i << ": "
                                 << other.world().state_difference(whole.world());
  }
}

TEST(Simulation, GoesOnFromAFileInANewSimulation) {
  const test::TemporaryFolder folder;
  Simulation one = busy_simulation();
  step_to(one, 50);
  ASSERT_TRUE(one.save(folder / "state.bin"));
  step_to(one, 80);
  Simulation other = busy_simulation();
  const auto loaded = other.load(folder / "state.bin");
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(other.frame(), 50u);
  step_to(other, 80);
  EXPECT_EQ(one.hash(), other.hash()) << one.world().state_difference(other.world());
}

TEST(Simulation, RefusesAFileThatIsCutOffDamagedOrOfAnotherScene) {
  const test::TemporaryFolder folder;
  Simulation one = busy_simulation();
  step_to(one, 5);
  ASSERT_TRUE(one.save(folder / "state.bin"));
  std::ifstream in(folder / "state.bin", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::string hash = one.hash();
  const auto refused = [&](const std::string& text) {
    std::ofstream(folder / "bad.bin", std::ios::binary) << text;
    const auto loaded = one.load(folder / "bad.bin");
    EXPECT_FALSE(loaded);
    EXPECT_EQ(one.hash(), hash);
    return loaded ? "" : loaded.error().text();
  };
  refused(bytes.substr(0, bytes.size() / 2));
  std::string damaged = bytes;
  damaged[bytes.size() / 3] ^= 4;
  refused(damaged);
  refused("");

  SceneDescription scene = test::busy_scene();
  scene.source = "another";
  auto other = Simulation::create(test::build_shared(scene));
  ASSERT_TRUE(other);
  const auto loaded = other->load(folder / "state.bin");
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().text(), HasSubstr("another"));
  EXPECT_THAT(loaded.error().text(), HasSubstr("busy"));
  EXPECT_FALSE(other->restore(*one.snapshot()));
}

TEST(Simulation, RefusesControlsThatCannotBeAndStepsNothing) {
  Simulation one = busy_simulation();
  step_to(one, 3);
  const std::string hash = one.hash();
  const auto refused = [&](const auto& change) {
    Controls controls = one.path_controls();
    change(controls);
    const auto stepped = one.step(controls);
    EXPECT_FALSE(stepped);
    EXPECT_EQ(one.hash(), hash);
    return stepped ? "" : stepped.error().text();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refused([](Controls& c) { c.tools[0].tip.x() = kNan; }), HasSubstr("\"hook\""));
  EXPECT_THAT(refused([](Controls& c) { c.tools[1].jaw = kNan; }), HasSubstr("\"grasper\""));
  EXPECT_THAT(refused([](Controls& c) { c.tools[1].jaw = 1.5; }), HasSubstr("0 (closed)"));
  EXPECT_THAT(refused([](Controls& c) { c.tools[1].power = 10.0; }), HasSubstr("conducts"));
  EXPECT_THAT(refused([](Controls& c) { c.tools[0].blade = true; }), HasSubstr("knife"));
  EXPECT_THAT(refused([](Controls& c) { c.tools[0].power = -1.0; }), HasSubstr("-1 W"));
  EXPECT_THAT(refused([](Controls& c) { c.tools[0].tip.x() += 0.5; }), HasSubstr("jumps"));
  EXPECT_THAT(refused([](Controls& c) { c.tools.pop_back(); }),
              HasSubstr("expected the scene's 2"));
  EXPECT_THAT(refused([](Controls& c) { c.tools[0].tip = Vec3(0, 0, kTop + 1.5e-3 + 0.2); }),
              HasSubstr("trocar"));
}

TEST(Simulation, UnderThePathsOwnControlsIsTheRunAlongThePaths) {
  Simulation along = busy_simulation(), told = busy_simulation();
  step_to(along, 20);
  while (told.frame() < 20) ASSERT_TRUE(told.step(told.path_controls()));
  EXPECT_EQ(along.hash(), told.hash());
}

TEST(Simulation, FollowsControlsThatLeaveThePaths) {
  Simulation along = busy_simulation(), away = busy_simulation();
  while (away.frame() < 30) {
    Controls controls = away.path_controls();
    controls.tools[0].tip.z() += 10e-3;
    controls.tools[0].power = 0.0;
    ASSERT_TRUE(away.step(controls));
  }
  step_to(along, 30);
  EXPECT_NE(along.hash(), away.hash());
  EXPECT_EQ(away.heat(0).vaporised, 0.0);
}

TEST(Simulation, SharesItsModelBetweenThreads) {
  const Simulation alone = [] {
    Simulation one = busy_simulation();
    step_to(one, 25);
    return one;
  }();
  std::vector<std::string> hashes(3);
  std::vector<std::thread> threads;
  for (std::string& hash : hashes)
    threads.emplace_back([&hash] {
      auto one = Simulation::create(test::busy_model());
      if (!one) return;
      while (one->frame() < 25) one->step();
      hash = one->hash();
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::string& hash : hashes) EXPECT_EQ(hash, alone.hash());
}

TEST(Simulation, ShowsWithoutChangingWhatItShows) {
  Simulation one = busy_simulation();
  step_to(one, 30);
  const std::string before = one.hash();
  EXPECT_FALSE(one.surface(0).positions.empty());
  EXPECT_TRUE(one.force(0).allFinite());
  EXPECT_TRUE(one.tip(1).allFinite());
  EXPECT_GE(one.heat(0).greatest_temperature, 310.0);
  EXPECT_GT(one.airborne_smoke(), 0.0);
  EXPECT_GT(one.state_bytes(), 1000u);
  EXPECT_EQ(one.hash(), before);
}

}  // namespace
}  // namespace viscera
