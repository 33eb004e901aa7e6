// Who takes a step, and what happens where it can't.
#include "kernels/heat/heat_passes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "engine/verification/heat_case.h"
#include "kernels/base/archive.h"
#include "tests/kernels/heat/heated_liver.h"

namespace viscera {
namespace {

/// Computes as the CPU does on fields of its own, which come back when asked for; fails in the
/// `at`-th prepare(), or refuses to start.
class KeepingPasses final : public HeatPasses {
 public:
  explicit KeepingPasses(int at, bool refuses = false) : at_(at), refuses_(refuses) {}

  bool start(std::span<HeatBrick* const> warm, const HeatModel& model) override {
    if (refuses_) return fail();
    warm_ = warm;
    swap_in();
    return cpu_.start(warm, model);
  }
  HeatFlows prepare() override {
    if (--at_ != 0) return cpu_.prepare();
    swap_out();
    fail();
    return {};
  }
  HeatFlows rates() override { return cpu_.rates(); }
  void advance(double dt) override { cpu_.advance(dt); }
  void advance_stage(const SuperStage& stage, int j, double dt) override {
    cpu_.advance_stage(stage, j, dt);
  }
  void settle(double dt) override { cpu_.settle(dt); }
  bool finish(bool fields) override {
    for (HeatBrick* brick : warm_) brick->warm->stored = 0.0;
    cpu_.finish(fields);
    swap_out();
    return !fields || fetch(warm_);
  }
  bool fetch(std::span<HeatBrick* const> bricks) override {
    if (!trouble_.empty()) return false;
    for (HeatBrick* brick : bricks) {
      if (brick->warm->slot < 0) continue;
      const Fields& mine = kept_[static_cast<std::size_t>(brick->warm->slot)];
      brick->warm->excess = mine.excess;
      brick->water = mine.water;
      brick->charred = mine.charred;
      brick->dose = mine.dose;
      brick->coagulation = mine.coagulation;
      brick->collagen = mine.collagen;
    }
    ++fetches_;
    return true;
  }
  const std::string& trouble() const override { return trouble_; }
  int fetches() const { return fetches_; }

 private:
  struct Fields {
    HeatBrick::Values excess, water, charred, dose, coagulation, collagen;
  };
  bool fail() {
    trouble_ = "it broke";
    return false;
  }
  static void exchange(HeatBrick& brick, Fields& fields) {
    std::swap(brick.warm->excess, fields.excess);
    std::swap(brick.water, fields.water);
    std::swap(brick.charred, fields.charred);
    std::swap(brick.dose, fields.dose);
    std::swap(brick.coagulation, fields.coagulation);
    std::swap(brick.collagen, fields.collagen);
  }
  void swap_in() {
    for (HeatBrick* brick : warm_) {
      HeatBrick::Warm& warm = *brick->warm;
      const Fields here{warm.excess, brick->water,       brick->charred,
                        brick->dose, brick->coagulation, brick->collagen};
      if (warm.slot < 0) {
        warm.slot = static_cast<int>(kept_.size());
        kept_.push_back(here);
      } else if (warm.altered) {
        kept_[static_cast<std::size_t>(warm.slot)] = here;
      }
      warm.altered = false;
      exchange(*brick, kept_[static_cast<std::size_t>(warm.slot)]);
    }
  }
  void swap_out() {
    for (HeatBrick* brick : warm_)
      exchange(*brick, kept_[static_cast<std::size_t>(brick->warm->slot)]);
  }

  CpuHeatPasses cpu_;
  std::span<HeatBrick* const> warm_;
  std::vector<Fields> kept_;
  int at_, fetches_ = 0;
  bool refuses_;
  std::string trouble_;
};

Bioheat liver() {
  return Bioheat(ThermalTissue{}, BioheatOptions{}, half_space());
}

void burn_for(Bioheat& heat, int steps) {
  burn(heat, 10.0, steps * kPictureTime);
}

bool same(const Bioheat& a, const Bioheat& b) {
  const HeatDifference off = heat_difference(a, b);
  return off.same_bricks && off.excess + off.water + off.charred + off.damage == 0.0;
}

TEST(HeatPasses, ADeviceDoesWhatTheCpuDoes) {
  Bioheat cpu = liver(), other = liver();
  const auto passes = std::make_shared<KeepingPasses>(-1);
  other.compute_on(passes);
  burn_for(cpu, 20);
  burn_for(other, 20);
  EXPECT_EQ(other.device(), passes.get());
  EXPECT_TRUE(same(cpu, other));
  EXPECT_EQ(other.book().delivered, cpu.book().delivered);
  EXPECT_EQ(other.book().perfused, cpu.book().perfused);
}

TEST(HeatPasses, ADeviceThatRefusesOrFailsInAStepChangesNothing) {
  for (const bool refuses : {false, true}) {
    Bioheat cpu = liver(), other = liver();
    other.compute_on(std::make_shared<KeepingPasses>(7, refuses));
    burn_for(cpu, 20);
    burn_for(other, 20);
    EXPECT_EQ(other.device(), nullptr);
    EXPECT_EQ(other.device_failure(), "it broke");
    EXPECT_TRUE(same(cpu, other));
    EXPECT_EQ(other.book().delivered, cpu.book().delivered);
    EXPECT_EQ(other.book().latent, cpu.book().latent);
  }
}

TEST(HeatPasses, FieldsComeWhenAskedForAndWithWhatTheBookSays) {
  Bioheat cpu = liver(), other = liver();
  const auto passes = std::make_shared<KeepingPasses>(-1);
  other.compute_on(passes, HeatReturn::kWhenAsked);
  burn_for(cpu, 20);
  burn_for(other, 20);
  EXPECT_EQ(passes->fetches(), 0);
  EXPECT_FALSE(same(cpu, other));
  other.fetch();
  other.fetch();
  EXPECT_EQ(passes->fetches(), 1);
  EXPECT_TRUE(same(cpu, other));
  EXPECT_LT(std::abs(other.book().residual()), 1e-4 * other.book().delivered);
}

TEST(HeatPasses, WhatWasntFetchedFromABrokenDeviceNeverWas) {
  Bioheat cpu = liver(), other = liver();
  other.compute_on(std::make_shared<KeepingPasses>(16), HeatReturn::kWhenAsked);
  burn_for(cpu, 10);
  burn_for(other, 10);
  other.fetch();
  burn_for(cpu, 1);
  // Five steps go on the device, the sixth fails there and is taken again from the tenth's end.
  burn_for(other, 6);
  EXPECT_EQ(other.device(), nullptr);
  EXPECT_EQ(other.book().delivered, cpu.book().delivered);
  EXPECT_LT(std::abs(other.book().residual()), 1e-4 * other.book().delivered);
  const Vec3 middle(0.4e-3, 0.1e-3, -0.5e-3);
  const BrickIndex voxel = cpu.bricks().voxel_of(middle);
  EXPECT_EQ(other.bricks().excess_at(voxel), cpu.bricks().excess_at(voxel));
}

TEST(HeatPasses, ADevicesStateIsThatOfEveryStepAndItTakesARestoredOneAnew) {
  Bioheat cpu = liver(), other = liver();
  other.compute_on(std::make_shared<KeepingPasses>(-1));
  const auto state = [](const Bioheat& heat) { return saved(heat); };
  burn_for(cpu, 10);
  burn_for(other, 10);
  const std::vector<std::byte> then = state(other);
  EXPECT_EQ(then, state(cpu));
  for (int step = 0; step < 10; ++step) {
    burn_for(cpu, 1);
    burn_for(other, 1);
    ASSERT_EQ(state(other), state(cpu));
  }
  const std::vector<std::byte> end = state(cpu);
  Bioheat fresh = liver();
  fresh.compute_on(std::make_shared<KeepingPasses>(-1));
  for (Bioheat* heat : {&other, &fresh}) {
    ByteReader reader(then);
    read(reader, *heat);
    ASSERT_FALSE(reader.failed());
    EXPECT_NE(heat->device(), nullptr);
    burn_for(*heat, 10);
    EXPECT_EQ(state(*heat), end);
  }
}

TEST(HeatPasses, WhatADeviceKeepsIsInTheStateOnceFetched) {
  Bioheat cpu = liver(), other = liver();
  other.compute_on(std::make_shared<KeepingPasses>(-1), HeatReturn::kWhenAsked);
  burn_for(cpu, 10);
  burn_for(other, 10);
  other.fetch();
  const std::vector<std::byte> then = saved(other);
  EXPECT_EQ(then, saved(cpu));
  // Goes on unfetched, and back.
  burn_for(other, 3);
  ByteReader reader(then);
  read(reader, other);
  EXPECT_EQ(saved(other), then);
  burn_for(cpu, 5);
  burn_for(other, 5);
  other.fetch();
  EXPECT_EQ(saved(other), saved(cpu));
}

}  // namespace
}  // namespace viscera
