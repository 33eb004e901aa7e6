// Many bodies that nothing holds, on each other.
#include "engine/features/free_bodies/ball_heap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"
#include "kernels/points/surface.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

bool all_rest(const World& world) {
  return std::ranges::all_of(world.all<Resting>(), &Resting::rests);
}

TEST(BallHeap, SettlesAndRestsOnWhatCarriesItsWeight) {
  auto world = build(ball_heap({}));
  ASSERT_TRUE(world);
  FlagSet flags;
  while (!all_rest(*world) && world->time() < 3.0)
    flags.raise(step_until(*world, end_of_step(*world)));
  EXPECT_TRUE(all_rest(*world));
  EXPECT_EQ(flags, FlagSet());
  const TouchingFigures& figures = *world->one<TouchingFigures>();
  EXPECT_EQ(figures.failed, 0u);
  EXPECT_LT(figures.residual, 1e-5);
  EXPECT_GT(figures.most_rows, 1000u) << "so many that pairs are answered in turn";
  double force = 0.0, weight = 0.0;
  for (const OrganContact& contact : world->all<OrganContact>())
    for (const Vec3& one : contact.solution.forces) force += one.z();
  for (const OrganBody& body : world->all<OrganBody>())
    if (body.model->deformable()) weight += 1060.0 * 9.81 * std::abs(volume(body.model->surface));
  EXPECT_NEAR(force, weight, 0.01 * weight);
}

TEST(BallHeap, GoesOnFromASavedStateToTheSameBits) {
  auto world = build(ball_heap({}));
  ASSERT_TRUE(world);
  step_until(*world, 0.1);
  expect_same_from_saved(*world, 0.2);
}

}  // namespace
}  // namespace viscera::test
