// First version of cautery: the burn deposits energy in rest-space bricks. The physics of heat replaces
// it behind this stage.
#include <algorithm>
#include <utility>

#include "engine/systems/systems.h"
#include "engine/systems/tool_shape.h"

namespace viscera {
namespace {

/// A trace that jumps further than this within a frame is two burns [m].
constexpr double kTraceBreak = 5e-3;

/// The heated ball is wider than the wire: current spreads into the tissue around the contact.
BurnParameters burn_parameters(const InstrumentDescription& hook) {
  BurnParameters parameters;
  parameters.radius = 1.5 * std::max(hook.tip.radius, kPointTipRadius);
  return parameters;
}

}  // namespace

void heat_tissue(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.burn_traces.size(); ++i) {
    const Entity instrument = world.burn_traces.owner(i);
    BurnTrace& trace = world.burn_traces[i];
    const InstrumentState& tool = *world.instrument_states.find(instrument);
    const InstrumentContact& contact = *world.instrument_contacts.find(instrument);
    trace.absorbed = 0.0;
    if (tool.power <= 0.0 || !contact.touching) {
      trace.burning = false;
      continue;
    }
    OrganBurn* burn = world.organ_burns.find(contact.organ);
    if (!burn) burn = &world.organ_burns.add(contact.organ, OrganBurn());
    const bool continues = trace.burning && trace.organ == contact.organ &&
                           (trace.rest_point - contact.rest_point).norm() < kTraceBreak;
    const Vec3 from = continues ? trace.rest_point : contact.rest_point;
    trace.absorbed =
        deposit_burn(burn->damage, from, contact.rest_point, tool.power, context.dt,
                     burn_parameters(world.instrument_bodies.find(instrument)->description));
    burn->energy += trace.absorbed;
    ++burn->version;
    trace.organ = contact.organ;
    trace.rest_point = contact.rest_point;
    trace.burning = true;
  }
}

void check_world(World& world, const FrameContext& context) {
  for (const OrganState& state : world.organ_states)
    if (state.frozen) context.report->raise(FrameFlag::kOrganFrozen);
}

}  // namespace viscera
