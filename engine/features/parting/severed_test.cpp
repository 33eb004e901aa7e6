// Pieces that a blade takes off a block: nothing holds them, so they fall.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <array>
#include <nlohmann/json.hpp>
#include <numeric>

#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/parting/parting.h"
#include "engine/features/parting/parting_flags.h"
#include "engine/features/touching/touching.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/points/closed_pieces.h"
#include "tests/support/cutting.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kSeveredBy = 1.5;  // ... and the piece is off [s]
constexpr double kFalling = 9.81, kFrameTime = 1.0 / 60.0;

/// The block is held at its left end, and what is right of the cut falls.
SceneDescription end_to_sever() {
  return bar_to_sever(Vec3::UnitZ(), Vec3(6e-3, 0, 0));
}
/// The block is held below, and the cut takes off its top.
SceneDescription top_to_sever() {
  SceneDescription scene = bar_to_sever(Vec3::UnitX(), Vec3(0, 0, 2e-3));
  Region& below = scene.organs[0].fixed[0];
  below.a = Vec3(0, 0, -0.5 * kBarToSever.z() + 0.1e-3);
  below.b = Vec3::UnitZ();
  scene.extras.set(TouchingDescription{.organs = true, .friction = 0.3});
  return scene;
}

const LoosePieces& loose_of(const World& world) {
  return world.all<OrganBody>()[0].model->finite->loose();
}
std::span<const double> displacements(const World& world) {
  return world.all<OrganTouch>()[0].solver->state().motion.displacements;
}
/// The mean displacement of the nodes of the piece that is off; `held`: of all others [m].
Vec3 gone(const World& world, bool held = false) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  const std::span<const double> u = displacements(world);
  for (std::size_t node = 0; node < u.size() / 3; ++node) {
    if (loose_of(world).has(node) == held) continue;
    sum += Vec3::Map(u.data() + 3 * node);
    ++count;
  }
  return sum / count;
}
/// Steps until a piece is off.
void sever(World& world) {
  while (loose_of(world).empty() && world.time() < kSeveredBy)
    step_until(world, world.time() + 0.01);
}

TEST(Severed, APieceThatNothingHoldsFallsAsGravitySays) {
  const auto world = build(end_to_sever());
  ASSERT_TRUE(world);
  sever(*world);
  ASSERT_EQ(loose_of(*world).pieces().size(), 1u);
  const std::uint64_t first = world->frame();
  EXPECT_EQ(step_until(*world, world->time() + 0.15), FlagSet());
  const auto steps = static_cast<double>(world->frame() - first + 1);
  EXPECT_NEAR(gone(*world).z(), -kFalling * kFrameTime * kFrameTime * steps * (steps + 1) / 2,
              2e-4);
  EXPECT_LT(gone(*world).head<2>().norm(), 2e-4);
  EXPECT_LT(gone(*world, true).norm(), 2e-4) << "what is held stays";
  EXPECT_EQ(closed_pieces(world->all<OrganBody>()[0].model->surface).size(), 2u);
  EXPECT_EQ(world->all<OrganCut>()[0].refused, 0u);
}

TEST(Severed, APieceOfABodyWithoutMassIsRefusedAndSaidSo) {
  SceneDescription scene = end_to_sever();
  scene.organs[0].finite.quasi_static = true;
  const auto world = build(scene);
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, kSeveredBy);
  EXPECT_TRUE(flags.has(kCutRefused));
  EXPECT_GE(world->all<OrganCut>()[0].refused, 1u);
  EXPECT_NE(world->all<OrganLeft>()[0].refusal.find("isn't held"), std::string::npos)
      << world->all<OrganLeft>()[0].refusal;
  EXPECT_TRUE(loose_of(*world).empty());
  EXPECT_FALSE(world->all<OrganState>()[0].frozen);
}

TEST(Severed, TheReportCountsPiecesAndThoseThatNothingHolds) {
  const auto world = build(end_to_sever());
  ASSERT_TRUE(world);
  sever(*world);
  const std::vector<ReportSection> sections = parting_report(*world);
  ASSERT_EQ(sections.size(), 1u);
  const nlohmann::json told = nlohmann::json::parse(sections[0].json);
  EXPECT_EQ(told["pieces"], 2);
  EXPECT_EQ(told["organs"][0]["loose_pieces"], 1);
  EXPECT_EQ(told["bonds_broken"]["force"], 0);
}

TEST(Severed, APieceThatHasFallenOutOfViewStaysThere) {
  const auto world = build(end_to_sever());
  ASSERT_TRUE(world);
  sever(*world);
  EXPECT_EQ(step_until(*world, world->time() + 1.0), FlagSet());
  const Vec3 there = gone(*world);
  EXPECT_GT(there.norm(), 0.5);
  EXPECT_EQ(step_until(*world, world->time() + 1.0), FlagSet());
  EXPECT_LT((gone(*world) - there).norm(), 1e-3);
  EXPECT_FALSE(world->all<OrganState>()[0].frozen);
}

TEST(Severed, ATopLiesOnWhatIsLeftByItsWeight) {
  const auto world = build(top_to_sever());
  ASSERT_TRUE(world);
  sever(*world);
  ASSERT_EQ(loose_of(*world).pieces().size(), 1u);
  EXPECT_EQ(step_until(*world, world->time() + 1.5), FlagSet());
  // It has come down by the width of the kerf.
  EXPECT_NEAR(gone(*world).z(), -0.8e-3, 0.15e-3);
  EXPECT_LT(gone(*world).head<2>().norm(), 0.3e-3);
  double pressed = 0.0;
  for (const PairState& pair : world->all<PairState>())
    for (const Meeting& meeting : pair.meetings) pressed += meeting.force.z();
  constexpr double kDensity = 1060.0;
  const auto pieces = closed_pieces(world->all<OrganBody>()[0].model->surface);
  ASSERT_EQ(pieces.size(), 2u);
  const double weight = kDensity * kFalling * std::min(volume(pieces[0]), volume(pieces[1]));
  EXPECT_NEAR(std::abs(pressed), weight, 0.02 * weight);
  EXPECT_LT(world->one<TouchingFigures>()->greatest_overlap, 0.2e-3);
}

TEST(Severed, ARunIsTheSameOnAnyNumberOfThreadsAndFromASnapshotWhileAPieceFalls) {
  const Model model = build_shared(top_to_sever());
  std::array<std::string, 2> hashes;
  constexpr double kEnd = 2.0;
  for (const std::size_t threads : {1, 2}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    auto simulation = Simulation::create(model);
    ASSERT_TRUE(simulation);
    while (simulation->time() < kEnd) simulation->step();
    hashes[threads - 1] = simulation->hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  auto one = Simulation::create(model);
  ASSERT_TRUE(one);
  while (loose_of(one->world()).empty() && one->time() < kSeveredBy) one->step();
  for (int frame = 0; frame < 3; ++frame) one->step();
  ASSERT_FALSE(loose_of(one->world()).empty());
  const auto snapshot = one->snapshot();
  auto other = Simulation::create(model);
  ASSERT_TRUE(other);
  const auto restored = other->restore(*snapshot);
  ASSERT_TRUE(restored) << restored.error().text();
  while (other->time() < kEnd) other->step();
  EXPECT_EQ(other->hash(), hashes[0]);
}

}  // namespace
}  // namespace viscera::test
