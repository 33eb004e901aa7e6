#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "engine/verification/hemisphere_body.h"
#include "haptics/hive_tissue.h"
#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "tests/haptics/allocations.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

constexpr double kBody = 0.04;  // radius of the organ [m]
constexpr double kBall = 4e-3;  // and of the tool
constexpr double kTick = 1e-3;
constexpr int kFrame = 17, kTicks = 520;

HiveTissueSettings settings_of(HyperelasticModel model, std::vector<PronyTerm> prony = {}) {
  HiveTissueSettings settings;
  settings.building = HiveBuilding::kInLockstep;
  settings.tool_radius = kBall;
  settings.hive.material = {5e3, 0.45};
  settings.hive.radius = 4.0 * kBall;
  settings.hive.nodes = 80;
  settings.model = model;
  settings.rings = model == HyperelasticModel::kLinear ? 2 : 3;
  settings.prony = std::move(prony);
  return settings;
}

// A round organ that breathes and sags, told of once a frame, and a tool that presses and slides so
// far that hives change.
class Life {
 public:
  explicit Life(const HiveTissueSettings& settings, int subdivisions = 4)
      : surface_(WalkableSurface::make(icosphere(kBody, subdivisions)).value()),
        tissue_(HiveTissue::create({&surface_, nullptr, nullptr}, settings).value()) {}

  HiveTissue& tissue() { return *tissue_; }

  // Ticks [from, to); the bits of all that is felt and seen in them. `way`: another tool's.
  std::string live(int from, int to, double way = 1.0) {
    Hasher hash;
    for (int tick = from; tick < to; ++tick) {
      if (tick % kFrame == 0) tell(tick, way);
      const auto at = [&](int t) { return place(t, way); };
      ToolMotion motion;
      motion.pose.position = at(tick);
      motion.velocity = (at(tick) - at(tick - 1)) / kTick;
      motion.tick = static_cast<std::uint64_t>(tick);
      const TactileForce felt = tissue_->respond(motion, kTick);
      hash.bytes(felt.force.data(), sizeof felt.force);
      hash.bytes(felt.stiffness.data(), sizeof felt.stiffness);
      hash.value(felt.energy).value(felt.supplied).value(felt.touching);
      const Vec3 seen = tissue_->displacement(surface_.nearest(at(tick)));
      hash.bytes(seen.data(), sizeof seen);
      touching += felt.touching;
    }
    write(hash, tissue_->figures());
    return hash.hex();
  }
  int touching = 0;

 private:
  static Vec3 place(int tick, double way) {
    const double angle = 1.1 * way * std::sin(7e-3 * tick);
    const double depth = 2.2e-3 * std::sin(0.031 * tick) + 0.6e-3;
    return (kBody + kBall - depth) * Vec3(std::sin(angle), 0.1, std::cos(angle)).normalized();
  }
  void tell(int tick, double way) {
    TissueSnapshot& snapshot = tissue_->snapshots().back();
    snapshot.tick = static_cast<std::uint64_t>(tick);
    snapshot.frame = snapshot.tick / kFrame;
    snapshot.pose.position = Vec3(0, 0, 1e-3 * std::sin(2e-3 * tick));
    // A writer that leaves some of a slot as it was: slots are state.
    if (tick % 2 == 0) snapshot.velocity = Vec3(0, 0, 2e-3 * std::cos(2e-3 * tick));
    if (tick % 3 == 0) {
      snapshot.hold.reach = 2e-3;
      snapshot.hold.root(2, 2) = 0.1 * std::cos(1e-2 * tick);
    }
    snapshot.nearest = surface_.nearest(place(tick, way)).point;
    tissue_->snapshots().publish();
  }

  WalkableSurface surface_;
  std::unique_ptr<HiveTissue> tissue_;
};

void restore(HiveTissue& tissue, std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  HiveTissue::State state;
  read(reader, state);
  ASSERT_TRUE(!reader.failed() && reader.at_end());
  ASSERT_TRUE(tissue.fits(state));
  tissue.restore(std::move(state));
}

void goes_on_bit_for_bit(const HiveTissueSettings& settings, std::uint64_t stream,
                         std::uint64_t draws) {
  const Random random(2026, stream);
  std::set<int> moments{0};
  for (std::uint64_t i = 0; i < draws; ++i)
    moments.insert(static_cast<int>(kTicks * random.uniform(i)));
  // Where a hive is under construction, and where one passes the force to another.
  Life scout(settings);
  bool built = false, passed = false;
  for (int tick = 0; tick < kTicks; ++tick) {
    scout.live(tick, tick + 1);
    const HiveTissue::State state = scout.tissue().state();
    if (!built && state.builder.busy && state.now >= 0) moments.insert(tick + 1);
    if (!passed && state.before >= 0) moments.insert(tick + 6);
    built = built || (state.builder.busy && state.now >= 0);
    passed = passed || state.before >= 0;
  }
  ASSERT_TRUE(built && passed);
  ASSERT_GT(scout.tissue().figures().hives, 3u);
  ASSERT_GT(scout.touching, kTicks / 3);

  Life lived(settings);
  lived.live(0, 173, -0.7);
  for (const int moment : moments) {
    Life first(settings);
    first.live(0, moment);
    const std::vector<std::byte> bytes = saved(first.tissue());
    const std::string whole = first.live(moment, kTicks);
    const std::vector<std::byte> end = saved(first.tissue());
    Life fresh(settings);
    for (Life* other : {&fresh, &lived, &first}) {
      restore(other->tissue(), bytes);
      EXPECT_EQ(saved(other->tissue()), bytes) << moment;
      EXPECT_EQ(other->live(moment, kTicks), whole) << moment;
      EXPECT_EQ(saved(other->tissue()), end) << moment;
    }
  }
}

const std::vector<PronyTerm> kSeries{{0.4, 0.05}, {0.2, 0.5}};

TEST(HiveTissueState, LinearTissueGoesOnBitForBitFromAnyTick) {
  goes_on_bit_for_bit(settings_of(HyperelasticModel::kLinear), 1, 5);
}

TEST(HiveTissueState, RelaxingTissueGoesOnBitForBitFromAnyTick) {
  goes_on_bit_for_bit(settings_of(HyperelasticModel::kLinear, kSeries), 2, 3);
}

TEST(HiveTissueState, NeoHookeanTissueThatRelaxesGoesOnBitForBitFromAnyTick) {
  goes_on_bit_for_bit(settings_of(HyperelasticModel::kNeoHookean, kSeries), 3, 2);
}

TEST(HiveTissueState, TissueThatGivesWayGoesOnBitForBitFromAnyTick) {
  goes_on_bit_for_bit(settings_of(HyperelasticModel::kStvk), 4, 1);
}

TEST(HiveTissueState, TicksAfterARestoreTakeNoMemory) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer keeps the heap";
  for (const HyperelasticModel model :
       {HyperelasticModel::kLinear, HyperelasticModel::kNeoHookean}) {
    Life first(settings_of(model, kSeries)), second(settings_of(model, kSeries));
    first.live(0, 100);
    restore(second.tissue(), saved(first.tissue()));
    ToolMotion motion;
    motion.pose.position = Vec3(0, 0, kBody + kBall - 1e-3);
    const std::uint64_t before = allocations();
    for (int i = 0; i < 300; ++i) {
      motion.tick = static_cast<std::uint64_t>(100 + i);
      motion.pose.position.x() = 1e-4 * i;
      second.tissue().respond(motion, kTick);
    }
    EXPECT_EQ(allocations(), before);
    EXPECT_GT(second.tissue().figures().hives, first.tissue().figures().hives);
  }
}

TEST(HiveTissueState, WhatIsCutShortOrOfAnotherTissueIsRefused) {
  const HiveTissueSettings settings = settings_of(HyperelasticModel::kNeoHookean, kSeries);
  Life life(settings);
  life.live(0, 120);
  const HiveTissue& tissue = life.tissue();
  const std::vector<std::byte> bytes = saved(tissue);
  for (std::size_t n = 0; n < bytes.size(); n += 1 + bytes.size() / 97) {
    ByteReader reader(std::span<const std::byte>(bytes).first(n));
    HiveTissue::State state;
    read(reader, state);
    EXPECT_TRUE(reader.failed()) << n;
  }
  ASSERT_TRUE(tissue.fits(tissue.state()));
  EXPECT_FALSE(Life(settings, 2).tissue().fits(tissue.state()));
  EXPECT_FALSE(Life(settings_of(HyperelasticModel::kLinear)).tissue().fits(tissue.state()));
  HiveTissueSettings other = settings;
  other.hive.nodes = 200;
  EXPECT_FALSE(Life(other).tissue().fits(tissue.state()));
  other = settings;
  other.building = HiveBuilding::kOnAThread;  // there is no going back
  EXPECT_FALSE(Life(other).tissue().fits(tissue.state()));

  using State = HiveTissue::State;
  const auto fits = [&](auto&& spoil) {
    State state = tissue.state();
    spoil(state);
    return tissue.fits(state);
  };
  EXPECT_FALSE(fits([](State& s) { s.snapshots.front = s.snapshots.back; }));
  EXPECT_FALSE(fits([](State& s) { s.snapshots.middle = 9; }));
  EXPECT_FALSE(fits([](State& s) {
    s.snapshots.slots[0].hold.root(0, 0) = std::numeric_limits<double>::quiet_NaN();
  }));
  EXPECT_FALSE(fits([](State& s) { s.snapshots.slots[1].nearest.triangle = 1 << 20; }));
  EXPECT_FALSE(fits([](State& s) { s.nearest.point.triangle = 1 << 20; }));
  EXPECT_FALSE(fits([](State& s) { s.foot.cells.pop_back(); }));
  EXPECT_FALSE(fits([](State& s) { s.now = 3; }));
  EXPECT_FALSE(fits([](State& s) { s.before = s.now; }));
  EXPECT_FALSE(fits([](State& s) { s.builder.busy = !s.builder.busy; }));
  EXPECT_FALSE(fits([](State& s) { s.builder.verdict = static_cast<HiveVerdict>(99); }));
  EXPECT_FALSE(fits([](State& s) { s.figures.last_refusal = static_cast<HiveVerdict>(-1); }));
  EXPECT_FALSE(fits([](State& s) { s.nonlinear.reset(); }));
  EXPECT_FALSE(fits([](State& s) { s.prony.q[5] = 1.0; }));
}

std::size_t heap_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// 64 simulations stand beside each other: this is most of what a held tool adds to one.
TEST(HiveTissueState, ItsThreeHivesOf120NodesTakeLittleMemory) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer keeps the heap";
  HemisphereOptions options;
  options.nodes = 300;
  options.touchable_zone = 0.9;
  const auto body = HemisphereBody::prepare(options, no_progress()).value();
  const auto surface = WalkableSurface::make(body->surface()).value();
  for (const HivePeriphery periphery :
       {HivePeriphery::kCoupled, HivePeriphery::kBoussinesq, HivePeriphery::kFixed})
    for (const HyperelasticModel model :
         {HyperelasticModel::kLinear, HyperelasticModel::kNeoHookean}) {
      HiveTissueSettings settings = settings_of(model, kSeries);
      settings.hive.periphery = periphery;
      settings.hive.nodes = 120;
      settings.hive.radius = 0.4 * kHemisphereRadius;
      const std::size_t before = heap_in_use();
      const auto tissue =
          HiveTissue::create({&surface, &body->compliance(), &body->touchable()}, settings);
      ASSERT_TRUE(tissue);
      const std::size_t taken = heap_in_use() - before;
      EXPECT_GT(taken, 100'000u);
      const bool linear = model == HyperelasticModel::kLinear;
      EXPECT_LT(taken, linear ? 700'000u : 900'000u) << name_of(periphery) << ' ' << name_of(model);
      EXPECT_LT(saved_bytes((*tissue)->state()), 60'000u);
    }
}

}  // namespace
}  // namespace viscera::test
