// A strand that a jaw draws out to nearly twice its length, against the same frames solved to the
// end: so far strained, tissue is several times as stiff as its factor at rest says.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kStrand(60e-3, 9e-3, 7e-3);  // both its ends are held [m]
const Vec3 kDrawn(0.0, 25e-3, 36e-3);   // so far goes its middle [m]
constexpr double kDown = 0.2, kHeldFrom = 0.3, kFrom = 0.5, kUntil = 2.0,
                 kFrameOff = 1.0 / 60.0;  // [s]

struct Drawn {
  std::vector<Vec3> forces;
  FlagSet flags;
  double stretch = 0.0;  ///< length of half of it over that at rest, at the end
};

Drawn draw_out(int iterations) {
  SceneDescription scene = held_bar_scene(kStrand, 1.5e-3, 0.5e-3, 3e-3, 3e-3);
  OrganDescription& strand = scene.organs[0];
  Region right = strand.fixed[0];
  right.a.x() = -right.a.x();
  right.b = -right.b;
  strand.fixed.push_back(right);
  strand.response = Response::kFinite;
  strand.finite.iterations = iterations;
  const Vec3 above(0.0, 0.0, 0.5 * kStrand.z() + 6e-3), grip(0.0, 0.0, 0.5 * kStrand.z() - 2e-3);
  InstrumentDescription grasper = straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                                {{0.0, above, 0.0, 1.0},
                                                 {kDown, grip, 0.0, 1.0},
                                                 {kHeldFrom, grip, 0.0, 0.0},
                                                 {kFrom, grip, 0.0, 0.0},
                                                 {kUntil, grip + kDrawn, 0.0, 0.0},
                                                 {kUntil + 1.0, grip + kDrawn, 0.0, 0.0}});
  grasper.grip_radius = 3.5e-3;
  scene.instruments = {grasper};
  Drawn drawn;
  const auto world = build(scene);
  if (!world) return drawn;
  while (world->time() < kUntil + 0.5) {
    drawn.flags.raise(step_until(*world, world->time() + 0.5 * kFrameOff));
    drawn.forces.push_back(world->all<InstrumentContact>()[0].force);
  }
  const double half = 0.5 * kStrand.x(), off = world->all<OrganState>()[0].greatest_displacement;
  drawn.stretch = std::hypot(half, off) / half;
  return drawn;
}

TEST(Finite, AStrandThatIsDrawnOutFarPullsAsItsEnergySaysAndStaysWhole) {
  const Drawn few = draw_out(2), many = draw_out(60);
  ASSERT_EQ(few.forces.size(), many.forces.size());
  ASSERT_FALSE(many.forces.empty());
  EXPECT_EQ(many.flags, FlagSet());
  EXPECT_FALSE(few.flags.has(kContactNotConverged));
  EXPECT_FALSE(few.flags.has(kTissueLost));
  EXPECT_GT(few.stretch, 1.5);
  const double most = many.forces.back().norm();
  EXPECT_GT(most, 0.2);
  EXPECT_LT(most, 5.0);
  for (std::size_t f = 0; f < many.forces.size(); ++f)
    EXPECT_LT((few.forces[f] - many.forces[f]).norm(), 0.08 * most) << "frame " << f;
  EXPECT_LT((few.forces.back() - many.forces.back()).norm(), 0.01 * most);
}

}  // namespace
}  // namespace viscera::test
