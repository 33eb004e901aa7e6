// What heat keeps from step to step: written, read again, and gone on from to the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "kernels/heat/electrode.h"
#include "tests/kernels/heat/heated_liver.h"

namespace viscera {
namespace {

template <class T>
std::string hash_of(const T& value) {
  Hasher hasher;
  write(hasher, value);
  return hasher.hex();
}

template <class T>
void give(const std::vector<std::byte>& bytes, T& to) {
  ByteReader reader(bytes);
  read(reader, to);
  ASSERT_FALSE(reader.failed());
  ASSERT_TRUE(reader.at_end());
}

BioheatOptions options_for_few() {
  BioheatOptions options;
  options.followed = 0.5;
  return options;
}

/// A hook that burns and goes away over the liver, warming bricks that are let go again.
struct Burn {
  Bioheat heat{ThermalTissue{}, options_for_few(), half_space()};
  ElectrodeTip tip;
  static constexpr int kSteps = 160;

  /// Everything that step `i` leaves and anybody can ask for.
  std::string step(int i) {
    ElectrodeContact at;
    at.point = Vec3(0.4e-3 * i, 0.2e-3 * (i % 3), 0.3e-3);
    at.depth = i < 100 ? 0.2e-3 : -5e-3;
    if (i < 12 || (i >= 30 && i < 36))
      tip.energise(heat, CurrentMode::kCoagulate, 30.0, at, at, kPictureTime);
    else if (i < 60)
      tip.energise(heat, CurrentMode::kCut, i % 2 ? 0.05 : 0.0, at, at, kPictureTime);
    else
      tip.cool(kPictureTime);
    heat.step(i < 60 ? kPictureTime : 0.5);
    Hasher hasher;
    write(hasher, heat.state());
    write(hasher, tip.state());
    write(hasher, heat.book());
    for (const double seen :
         {heat.excess_now(), heat.tissue_above(330.0), heat.coagulated_volume(), heat.dead_volume(),
          heat.greatest_excess(), heat.vaporised_water(), heat.vaporised_tissue()})
      hasher.value(seen);
    hasher.value<std::uint64_t>(heat.warm_bricks()).value(heat.passes_of_last_step());
    return hasher.hex();
  }
};

TEST(HeatState, AnyMomentGoesOnToTheSameBits) {
  Burn first;
  std::vector<std::string> hashes;
  std::vector<std::vector<std::byte>> heats, tips;
  std::size_t most = 0, least_after = std::numeric_limits<std::size_t>::max();
  for (int i = 0; i < Burn::kSteps; ++i) {
    heats.push_back(saved(first.heat));
    tips.push_back(saved(first.tip));
    hashes.push_back(first.step(i));
    most = std::max(most, first.heat.bricks().count());
    least_after = std::min(i < 60 ? least_after : first.heat.bricks().count(), least_after);
  }
  // Bricks were made, harmed, and let go while others stayed: their order isn't that of making.
  EXPECT_GT(first.heat.coagulated_volume(), 0.0);
  EXPECT_GT(first.heat.vaporised_water(), 0.0);
  EXPECT_LT(least_after, most);
  EXPECT_GT(least_after, 0u);

  const Random random(15, 0);
  Burn other;  // lives on from moment to moment
  for (std::uint64_t draw = 0; draw < 12; ++draw) {
    const int moment = static_cast<int>(random.bits(draw) % Burn::kSteps);
    SCOPED_TRACE(moment);
    Burn fresh;
    for (Burn* burn : {&fresh, &other}) {
      give(heats[static_cast<std::size_t>(moment)], burn->heat);
      give(tips[static_cast<std::size_t>(moment)], burn->tip);
      EXPECT_EQ(saved(burn->heat), heats[static_cast<std::size_t>(moment)]);
    }
    for (int i = moment; i < Burn::kSteps; ++i) {
      ASSERT_EQ(fresh.step(i), hashes[static_cast<std::size_t>(i)]) << i;
      if (i < moment + 40) {
        ASSERT_EQ(other.step(i), hashes[static_cast<std::size_t>(i)]) << i;
      }
    }
  }
}

TEST(HeatState, ACopyIsOnItsOwnAndGoesBackToItsMoment) {
  Burn burn;
  for (int i = 0; i < 20; ++i) burn.step(i);
  Bioheat::State kept = burn.heat.state();
  const ElectrodeTip::State tip = burn.tip.state();
  const std::string then = hash_of(kept);
  std::vector<std::string> hashes;
  for (int i = 20; i < 70; ++i) hashes.push_back(burn.step(i));
  EXPECT_EQ(hash_of(kept), then);
  EXPECT_NE(hash_of(burn.heat.state()), then);
  burn.heat.restore(std::move(kept));
  burn.tip.restore(tip);
  EXPECT_EQ(hash_of(burn.heat.state()), then);
  for (int i = 20; i < 70; ++i)
    ASSERT_EQ(burn.step(i), hashes[static_cast<std::size_t>(i - 20)]) << i;
}

TEST(HeatState, StaysWithHeatThatIsMoved) {
  Burn burn;
  for (int i = 0; i < 20; ++i) burn.step(i);
  const std::string then = hash_of(burn.heat);
  std::vector<Bioheat> organs;
  organs.push_back(std::move(burn.heat));
  organs.emplace_back(ThermalTissue{}, BioheatOptions{});
  organs.reserve(organs.capacity() + 1);
  EXPECT_EQ(hash_of(organs[0]), then);
  EXPECT_EQ(&organs[0].state().bricks.bricks[0]->water, &organs[0].bricks().brick(0).water);
  organs[0].restore(Bioheat::State(organs[0].state()));
  organs[0].step(kPictureTime);
  EXPECT_NE(hash_of(organs[0]), then);
}

TEST(HeatState, AsksForTheSurfaceOnlyWhereItDoesntKnowIt) {
  int asked = 0;
  const SignedDistance counting = [&](const Vec3& p) {
    ++asked;
    return p.z() - 0.3e-3;
  };
  HeatBricks bricks(0.5e-3, counting, 100);
  for (int x = 0; x < 3; ++x) bricks.warm_up(BrickIndex(x, 0, 0));
  const std::vector<std::byte> bytes = saved(bricks);
  asked = 0;
  bricks.restore(HeatBricks::State(bricks.state()));
  give(bytes, bricks);
  EXPECT_EQ(asked, 0);
  HeatBricks fresh(0.5e-3, counting, 100);
  give(bytes, fresh);
  EXPECT_GT(asked, 0);
  ASSERT_EQ(fresh.count(), 3u);
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_EQ(fresh.brick(b).geometry->fraction, bricks.brick(b).geometry->fraction);
    EXPECT_EQ(fresh.brick(b).neighbours[1], b < 2 ? &fresh.brick(b + 1) : nullptr);
    EXPECT_EQ(fresh.brick(b).neighbours[0], b > 0 ? &fresh.brick(b - 1) : nullptr);
  }
}

TEST(HeatState, APlaceThatIsKnownToHoldNoTissueStillIsWhenThereIsNoRoom) {
  HeatBricks bricks(0.5e-3, half_space(), 2), other(0.5e-3, half_space(), 2);
  const BrickIndex above(0, 0, 3);
  EXPECT_EQ(bricks.warm_up(above), nullptr);
  for (int x = 0; x < 2; ++x) bricks.warm_up(BrickIndex(x, 0, -1));
  give(saved(bricks), other);
  for (HeatBricks* each : {&bricks, &other}) {
    EXPECT_EQ(each->warm_up(above), nullptr);
    EXPECT_FALSE(each->overflowed());
    EXPECT_EQ(each->warm_up(BrickIndex(2, 0, -1)), nullptr);
    EXPECT_TRUE(each->overflowed());
  }
}

TEST(HeatState, WhatCannotBeItsOwnIsRefused) {
  Burn burn;
  for (int i = 0; i < 20; ++i) burn.step(i);
  const Bioheat& heat = burn.heat;
  ASSERT_GE(heat.bricks().count(), 2u);
  const auto fits_with = [&](const auto& change) {
    Bioheat::State state = heat.state();
    change(state);
    return heat.fits(state);
  };
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  using State = Bioheat::State;
  EXPECT_TRUE(fits_with([](State&) {}));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[1]->index = s.bricks.bricks[0]->index; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->index.x() = 1 << 20; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0].reset(); }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->dose[7] = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->coagulation[7] = -1.0f; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->collagen[7] = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->water[7] = 1.5f; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->charred[7] = -0.5f; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->warm->excess[7] = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->warm->border[2] = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.bricks[0]->warm->idle = -1; }));
  EXPECT_FALSE(fits_with([](State& s) { s.bricks.empty.push_back(s.bricks.bricks[0]->index); }));
  EXPECT_FALSE(fits_with([](State& s) { s.totals.book.gas = kNone; }));
  EXPECT_FALSE(fits_with([](State& s) { s.vapour.push_back({.temperature = kNone}); }));
  BioheatOptions fewer = options_for_few();
  fewer.most_bricks = heat.bricks().count() - 1;
  EXPECT_FALSE(Bioheat(ThermalTissue{}, fewer, half_space()).fits(heat.state()));
  EXPECT_TRUE(burn.tip.fits(burn.tip.state()));
  EXPECT_FALSE(burn.tip.fits({std::numeric_limits<double>::infinity()}));
}

TEST(HeatState, BytesThatEndEarlyLeaveTheHeatAsItWas) {
  Burn burn;
  for (int i = 0; i < 5; ++i) burn.step(i);
  const std::vector<std::byte> bytes = saved(burn.heat);
  for (int i = 5; i < 10; ++i) burn.step(i);
  const std::string before = hash_of(burn.heat);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{9}, bytes.size() / 2, bytes.size() - 1}) {
    ByteReader reader(std::span<const std::byte>(bytes).first(size));
    read(reader, burn.heat);
    EXPECT_TRUE(reader.failed()) << size;
    EXPECT_EQ(hash_of(burn.heat), before);
  }
}

TEST(HeatState, ABrickIsItsFieldsAndLittleMore) {
  Burn burn;
  for (int i = 0; i < 20; ++i) burn.step(i);
  const std::size_t bricks = burn.heat.bricks().count(), warm = burn.heat.warm_bricks();
  constexpr std::size_t kField = sizeof(HeatBrick::Values);
  EXPECT_LT(saved_bytes(burn.heat.state().bricks),
            (5 * bricks + warm) * kField + 64 * bricks + 512);
}

}  // namespace
}  // namespace viscera
