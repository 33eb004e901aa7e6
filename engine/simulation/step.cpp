#include <optional>

#include "engine/simulation/feature.h"
#include "engine/simulation/schedule.h"
#include "engine/simulation/sentinel.h"

namespace viscera {
namespace {

/// Where the paths had the tools last, so that a step needs no new memory.
struct PathControls {
  Controls controls;
};

}  // namespace

FrameReport step_frame(World& world, const Controls& controls, Trace* trace) {
  FrameReport report;
  Aside aside;
  FrameContext context;
  context.frame = world.frame() + 1;
  const std::uint64_t last_tick = world.model().steps().last_tick(context.frame);
  context.dt = static_cast<double>(last_tick - world.tick()) * 1e-3;
  context.time = static_cast<double>(last_tick) * 1e-3;
  context.report = &report;
  context.controls = &controls;
  context.aside = &aside;

  // A stage that the scene doesn't need isn't entered, and so isn't timed either.
  const std::vector<Stage>& stages = world.model().schedule().stages();
  Pool<Sentinel>& sentinels = world.all<Sentinel>();
  if (sentinels.size() == 0) sentinels.add(kWhole, {});
  sentinels[0].keep(world);
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (stages[i].needed && !stages[i].needed(world)) continue;
    std::optional<StageTimer> timer;
    if (trace) timer.emplace(*trace, static_cast<int>(i), context.frame);
    stages[i].run(world, context);
    sentinels[0].look(world, stages[i], report);
  }
  if (report.flags.size() > 1) report.flags.order(flags_of(world.model().features()));
  world.set_clock({last_tick, context.frame});
  return report;
}

FrameReport step_frame(World& world, Trace& trace) {
  Pool<PathControls>& kept = world.all<PathControls>();
  if (kept.size() == 0) kept.add(kWhole, {});
  controls_of_paths(world, end_of_step(world), kept[0].controls);
  return step_frame(world, kept[0].controls, &trace);
}

}  // namespace viscera
