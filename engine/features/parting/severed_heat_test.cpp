// A piece that a blade takes off has no blood.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "kernels/points/brick_map.h"
#include "tests/support/cutting.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kKerf = 6e-3;         // the middle of the cut, along x [m]
constexpr double kKerfReach = 0.7e-3;  // of the cut and half a voxel from there [m]
constexpr double kApartBy = 1.5;       // the piece is off [s]
constexpr double kHookGone = 0.4;      // [s]

/// A hook warms the right end of a block that is held at its left one, and a blade cuts it off.
/// `held_too`: the right end is held, too.
SceneDescription warm_end_to_sever(bool held_too = false) {
  SceneDescription scene = bar_to_sever(Vec3::UnitZ(), Vec3(kKerf, 0, 0));
  OrganDescription& block = scene.organs[0];
  if (held_too) {
    Region right;
    right.a = Vec3(0.5 * kBarToSever.x() - 0.1e-3, 0, 0);
    right.b = -Vec3::UnitX();
    block.fixed.push_back(right);
  }
  const double high = 0.5 * kBarToSever.z();
  InstrumentDescription hook = straight_tool("hook", InstrumentKind::kHook, 0.8e-3,
                                             {{0.0, Vec3(13e-3, 0, high + 3e-3), 0.0, 1.0},
                                              {0.1, Vec3(13e-3, 0, high + 0.4e-3), 0.7, 1.0},
                                              {0.3, Vec3(13e-3, 0, high + 0.4e-3), 0.0, 1.0},
                                              {kHookGone, Vec3(13e-3, 0, high + 9e-3), 0.0, 1.0}});
  scene.instruments.push_back(hook);
  return scene;
}

const OrganLeft& left_now(const World& world) {
  return world.all<OrganLeft>()[0];
}
const Bioheat& warmth_now(const World& world) {
  return world.all<OrganBurn>()[0].heat;
}
/// Steps until the body is in two pieces and the hook has gone.
void come_apart(World& world) {
  while ((left_now(world).pieces.empty() && world.time() < kApartBy) || world.time() < kHookGone)
    step_until(world, world.time() + 0.01);
}
/// The middle of a voxel of a brick, along x [m].
double middle_x(const BrickIndex& brick, int voxel, double edge) {
  return (brick.x() * BrickField::kEdge + voxel % BrickField::kEdge + 0.5) * edge;
}

TEST(SeveredHeat, VoxelsBeyondTheCutHaveNoBloodAndTheOthersHaveAll) {
  const auto world = build(warm_end_to_sever());
  ASSERT_TRUE(world);
  come_apart(*world);
  ASSERT_FALSE(left_now(*world).pieces.empty());
  const double voxel = warmth_now(*world).options().voxel;
  BrickMap listed;
  int off = 0, held = 0, as_before = 0;
  for (const ShapedBrick& shape : left_now(*world).heated) {
    EXPECT_EQ(listed.find(shape.index), BrickMap::kNone) << shape.index.transpose();
    listed.set(shape.index, 1);
    EXPECT_GE(shape.index.x(), 0) << "far from the cut what is held is as it was";
    as_before += shape.geometry == nullptr;
    for (int v = 0; v < BrickField::kVoxels; ++v) {
      const auto at = static_cast<std::size_t>(v);
      const double x = middle_x(shape.index, v, voxel);
      if (shape.geometry && !(shape.geometry->fraction[at] > 0.0f)) continue;
      if (std::abs(x - kKerf) < kKerfReach) continue;
      const float perfused = shape.geometry ? shape.geometry->perfused_at(at) : 0.0f;
      ASSERT_EQ(perfused, x < kKerf ? 1.0f : 0.0f) << shape.index.transpose() << ", " << x;
      ++(x < kKerf ? held : off);
    }
  }
  EXPECT_GT(off, 0);
  EXPECT_GT(held, 0);
  EXPECT_GT(as_before, 0) << "beside the cut they aren't made before they are warm";
  // All of the piece is there.
  const Vec3 inner = 0.5 * kBarToSever - Vec3::Constant(0.3e-3);
  for (double x = kKerf + 1e-3; x < inner.x(); x += voxel)
    for (double y = -inner.y(); y < inner.y(); y += voxel)
      for (double z = -inner.z(); z < inner.z(); z += voxel) {
        const BrickIndex brick =
            BrickField::brick_of(warmth_now(*world).bricks().voxel_of(Vec3(x, y, z)));
        ASSERT_NE(listed.find(brick), BrickMap::kNone) << brick.transpose();
      }
}

TEST(SeveredHeat, BloodTakesNothingFromAPieceThatIsOffAndTheBookCloses) {
  const auto world = build(warm_end_to_sever());
  ASSERT_TRUE(world);
  come_apart(*world);
  ASSERT_FALSE(left_now(*world).pieces.empty());
  const HeatBook then = warmth_now(*world).book();
  EXPECT_GT(then.perfused, 0.0) << "until then it had blood";
  step_until(*world, world->time() + 0.5);
  const HeatBook now = warmth_now(*world).book();
  EXPECT_GT(warmth_now(*world).excess_now(), 0.5) << "it is warm yet";
  // In some third of the time that it had, what is as warm would lose a third as much. A few
  // hundredths of the current's heat lie beyond the cut.
  EXPECT_LT(now.perfused - then.perfused, 0.05 * then.perfused);
  EXPECT_LT(now.metabolic - then.metabolic, 0.05 * then.metabolic);
  EXPECT_LT(std::abs(now.residual()), 1e-4 * now.delivered) << now.residual();
}

TEST(SeveredHeat, APieceThatIsHeldKeepsItsBlood) {
  const auto world = build(warm_end_to_sever(true));
  ASSERT_TRUE(world);
  come_apart(*world);
  ASSERT_FALSE(left_now(*world).pieces.empty());
  ASSERT_FALSE(left_now(*world).heated.empty());
  for (const ShapedBrick& shape : left_now(*world).heated) {
    ASSERT_NE(shape.geometry, nullptr);
    EXPECT_TRUE(shape.geometry->perfused.empty());
  }
  const HeatBook then = warmth_now(*world).book();
  step_until(*world, world->time() + 0.5);
  EXPECT_GT(warmth_now(*world).book().perfused, 1.1 * then.perfused);
}

TEST(SeveredHeat, ARestoredStateHasNoBloodWhereTheOneThatWasSavedHadNone) {
  const Model model = build_shared(warm_end_to_sever());
  auto one = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(one);
  ASSERT_TRUE(other);
  while (left_now(one->world()).pieces.empty() && one->time() < kApartBy) one->step();
  ASSERT_FALSE(left_now(one->world()).pieces.empty());
  one->step();
  const auto snapshot = one->snapshot();
  ASSERT_TRUE(snapshot);
  const auto restored = other->restore(*snapshot);
  ASSERT_TRUE(restored) << restored.error().text();
  const HeatBricks& bricks = warmth_now(one->world()).bricks();
  EXPECT_GT(bricks.count(), 0u);
  for (std::size_t b = 0; b < bricks.count(); ++b) {
    const HeatBrick* same = warmth_now(other->world()).bricks().find(bricks.brick(b).index);
    ASSERT_NE(same, nullptr);
    EXPECT_EQ(same->geometry->perfused, bricks.brick(b).geometry->perfused);
  }
  const double end = one->time() + 0.2;
  for (Simulation* each : {&*one, &*other})
    while (each->time() < end) each->step();
  EXPECT_EQ(other->hash(), one->hash());
}

}  // namespace
}  // namespace viscera::test
