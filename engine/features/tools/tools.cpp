#include "engine/features/tools/tools.h"

#include "engine/simulation/instruments.h"

namespace viscera {
namespace {

Result<void> start(World& world) {
  for (const Entity instrument : world.model().instruments()) {
    world.all<InstrumentState>().add(instrument, {});
    world.all<InstrumentContact>().add(instrument, {});
  }
  return {};
}

void read_tools(World& world, const FrameContext& context) {
  const Pool<InstrumentBody>& bodies = world.all<InstrumentBody>();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Entity instrument = bodies.owner(i);
    const ToolControl& control = context.controls->tools[i];
    InstrumentState& state = *world.find<InstrumentState>(instrument);
    state.jaw = control.jaw;
    state.power = control.power;
    state.blade = control.blade;
    // A held tool is where the hand has it (run servos); its control tells jaw and power, and where
    // it waits until its device is engaged. Without a servo, as in a benchmark, the path moves it.
    if (!world.find<HeldTip>(instrument))
      aim_tool(bodies[i], control.tip, state);
    else
      aim_tool(bodies[i], context.frame == 1 ? bodies[i].tip.at(0.0) : Vec3(state.tip), state);
  }
}

/// A hold that isn't finite begins where the jaw is: with places of zero it would pull from afar.
void grasp_anew(World& world, Entity instrument) {
  std::optional<Grasp>& grasp = world.find<InstrumentContact>(instrument)->grasp;
  if (!grasp || !first_stray(*grasp)) return;
  grasp->tip_at_start = world.find<InstrumentState>(instrument)->tip;
  grasp->organ_at_start = pose_of(world, grasp->organ).position;
  grasp->slipped = Vec3::Zero();
}

}  // namespace

Feature tools_feature() {
  return {.name = "tools",
          .start = start,
          .states = {state_type<InstrumentState>({Strays::Become::kAsBefore}),
                     state_type<InstrumentContact>({.contain = grasp_anew})},
          .stages = {{.name = "read tools",
                      .reads = {"controls"},
                      .writes = {"tool poses"},
                      .changes = {"tool poses"},
                      .run = read_tools}}};
}

}  // namespace viscera
