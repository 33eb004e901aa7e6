#include "tests/support/same_runs.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <array>

#include "engine/simulation/prepare.h"
#include "tests/support/small_world.h"

namespace viscera::test {

void expect_same_runs(const Model& model, const std::vector<double>& snapshots, double end,
                      const std::function<void(const Simulation&)>& at_end) {
  std::array<std::string, 2> hashes;
  std::vector<Snapshot> taken;
  for (const std::size_t threads : {1, 2}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    auto simulation = Simulation::create(model);
    ASSERT_TRUE(simulation);
    for (const double time : snapshots) {
      while (simulation->time() < time) simulation->step();
      if (threads == 1) taken.push_back(*simulation->snapshot());
    }
    while (simulation->time() < end) simulation->step();
    if (at_end) at_end(*simulation);
    hashes[threads - 1] = simulation->hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]) << "by one thread and by two";
  if (taken.empty()) return;
  auto other = Simulation::create(model);
  ASSERT_TRUE(other);
  // The last first: to go back is harder.
  for (std::size_t s = taken.size(); s-- > 0;) {
    const auto restored = other->restore(taken[s]);
    ASSERT_TRUE(restored) << restored.error().text();
    while (other->time() < end) other->step();
    EXPECT_EQ(other->hash(), hashes[0]) << "from " << snapshots[s] << " s";
  }
}

void expect_same_from_saved(World& world, double until) {
  auto other = start_world(world.shared_model());
  ASSERT_TRUE(other);
  ASSERT_TRUE((*other)->load_state(world.save_state()));
  EXPECT_EQ((*other)->state_difference(world), "");
  step_until(world, until);
  step_until(**other, until);
  EXPECT_EQ((*other)->state_difference(world), "");
}

}  // namespace viscera::test
