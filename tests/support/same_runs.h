// Whether a simulation comes to the same bits however it gets there.
#pragma once

#include <functional>
#include <vector>

#include "engine/simulator/simulation.h"

namespace viscera::test {

/// Runs until `end` [s] by one thread and by two, and from snapshots taken of the first run at
/// these times: all come to the same state. `at_end` looks at each of the first two.
void expect_same_runs(const Model& model, const std::vector<double>& snapshots, double end,
                      const std::function<void(const Simulation&)>& at_end = {});

/// A world as it is saved now is the same, and steps until then [s] to the same state.
void expect_same_from_saved(World& world, double until);

}  // namespace viscera::test
