#include <cmath>

#include "engine/systems/systems.h"

namespace viscera {
namespace {

/// A unit vector across the shaft that points as far down as it can: where a hook bends, and the
/// plane in which jaws open. A vertical shaft takes +x.
Vec3 side_of(const Vec3& shaft) {
  const Vec3 down = -Vec3::UnitZ();
  const Vec3 across = down - down.dot(shaft) * shaft;
  if (across.norm() > 1e-6) return across.normalized();
  return (Vec3::UnitX() - Vec3::UnitX().dot(shaft) * shaft).normalized();
}

}  // namespace

void place_tool(const InstrumentBody& body, double time, InstrumentState& state) {
  state.jaw = body.jaw.at(time).x();
  state.power = body.description.path[body.tip.key_at(time)].power;
  aim_tool(body, body.tip.at(time), state);
}

void aim_tool(const InstrumentBody& body, const Vec3& tip, InstrumentState& state) {
  state.tip = tip;
  const Vec3 shaft = body.description.trocar - state.tip;
  // A tip in its own trocar has no direction; it keeps the last one.
  if (shaft.norm() > 1e-9) state.shaft_direction = shaft.normalized();
  state.side_direction = Eigen::AngleAxisd(body.description.roll, state.shaft_direction) *
                         side_of(state.shaft_direction);
}

void read_tools(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i) {
    const InstrumentBody& body = world.instrument_bodies[i];
    InstrumentState& state = *world.instrument_states.find(world.instrument_bodies.owner(i));
    // A held tool is where the hand has it (run_servos); its path tells jaw and power, and where it
    // waits until its device is engaged. Without a servo, as in a benchmark, the path moves it.
    const Vec3 held = state.tip;
    place_tool(body, context.time, state);
    if (!world.haptics || !body.description.haptic) continue;
    aim_tool(body, context.frame == 1 ? body.tip.at(0.0) : held, state);
  }
}

}  // namespace viscera
