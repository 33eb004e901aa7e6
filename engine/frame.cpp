#include "engine/frame.h"

#include "engine/systems/systems.h"

namespace viscera {

FrameReport step_frame(World& world, Trace& trace) {
  FrameReport report;
  FrameContext context;
  context.frame = world.frame + 1;
  const std::uint64_t last_tick = last_tick_of_frame(context.frame);
  context.dt = static_cast<double>(last_tick - world.tick) * 1e-3;
  context.time = static_cast<double>(last_tick) * 1e-3;
  context.report = &report;

  // A stage that the scene doesn't need isn't entered, and so isn't timed either.
  const bool breathing = world.organ_motions.size() > 0;
  const bool cautery = world.burn_traces.size() > 0;
  const bool smoke = world.smoke.size() > 0;
  const auto run = [&](Stage stage, void (*system)(World&, const FrameContext&)) {
    const StageTimer timer(trace, stage_index(stage), context.frame);
    system(world, context);
  };
  run(Stage::kReadTools, read_tools);
  if (world.haptics) run(Stage::kRunServos, run_servos);
  if (breathing) run(Stage::kMoveOrgans, move_organs);
  if (world.organ_sags.size() + world.organ_changes.size() > 0) run(Stage::kSagOrgans, sag_organs);
  run(Stage::kFindContacts, find_contacts);
  run(Stage::kDeformOrgans, deform_organs);
  if (cautery) run(Stage::kHeatTissue, heat_tissue);
  if (smoke) run(Stage::kEmitSmoke, emit_smoke);
  if (smoke) run(Stage::kMoveSmoke, move_smoke);
  if (world.gpu) run(Stage::kFetchSurfaces, fetch_surfaces);
  if (world.haptics) run(Stage::kPublish, publish_to_servos);
  run(Stage::kCheck, check_world);

  world.tick = last_tick;
  world.frame = context.frame;
  return report;
}

}  // namespace viscera
