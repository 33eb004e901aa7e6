// THE loop over steps: every command that steps a simulation does it here.
#pragma once

#include <cstdint>
#include <functional>

#include "engine/simulator/simulation.h"

namespace viscera {

struct Loop {
  /// Until so many frames are done since the scene's beginning.
  std::uint64_t until = 0;
  /// Before each step; may wait for the time to come. False ends the loop. None: at once.
  std::function<bool(Simulation&)> pace = {};
  /// What moves the tools in the next step. None: the scene's paths.
  std::function<Result<Controls>(const Simulation&)> controls = {};
  /// After each step; what fails here, or there, ends the loop with it.
  std::function<Result<void>(Simulation&, const StepReport&)> look = {};
};

Result<void> step_through(Simulation& simulation, const Loop& loop);

}  // namespace viscera
