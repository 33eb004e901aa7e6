#include "engine/simulator/loop.h"

namespace viscera {

Result<void> step_through(Simulation& simulation, const Loop& loop) {
  while (simulation.frame() < loop.until) {
    if (loop.pace && !loop.pace(simulation)) return {};
    Result<StepReport> report;
    if (loop.controls) {
      const auto controls = loop.controls(simulation);
      if (!controls) return std::unexpected(controls.error());
      report = simulation.step(*controls);
    } else {
      report = simulation.step();
    }
    if (!report) return std::unexpected(report.error());
    if (loop.look)
      if (auto looked = loop.look(simulation, *report); !looked) return looked;
  }
  return {};
}

}  // namespace viscera
