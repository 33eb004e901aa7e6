#include "engine/frame.h"

#include "engine/systems/systems.h"

namespace viscera {

FrameReport step_frame(World& world, StageClock& clock) {
  FrameReport report;
  FrameContext context;
  context.frame = world.frame + 1;
  const std::uint64_t last_tick = last_tick_of_frame(context.frame);
  context.dt = static_cast<double>(last_tick - world.tick) * 1e-3;
  context.time = static_cast<double>(last_tick) * 1e-3;
  context.report = &report;
  clock.begin_frame(context.frame);

  {
    const auto timed = clock.measure(Stage::kReadTools);
    read_tools(world, context);
  }
  {
    const auto timed = clock.measure(Stage::kFindContacts);
    find_contacts(world, context);
  }
  {
    const auto timed = clock.measure(Stage::kDeformOrgans);
    deform_organs(world, context);
  }
  // A stage that the scene doesn't need isn't entered, and so isn't timed either.
  if (world.burn_traces.size() > 0) {
    {
      const auto timed = clock.measure(Stage::kHeatTissue);
      heat_tissue(world, context);
    }
    if (world.smoke.size() > 0) {
      const auto timed = clock.measure(Stage::kEmitSmoke);
      emit_smoke(world, context);
    }
  }
  if (world.smoke.size() > 0) {
    const auto timed = clock.measure(Stage::kMoveSmoke);
    move_smoke(world, context);
  }
  {
    const auto timed = clock.measure(Stage::kCheck);
    check_world(world, context);
  }

  world.tick = last_tick;
  world.frame = context.frame;
  return report;
}

}  // namespace viscera
