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

void read_tools(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i) {
    const InstrumentBody& body = world.instrument_bodies[i];
    InstrumentState& state = *world.instrument_states.find(world.instrument_bodies.owner(i));
    state.previous_tip = state.started ? state.tip : body.tip.at(context.time);
    state.tip = body.tip.at(context.time);
    state.previous_jaw = state.started ? state.jaw : 1.0;
    state.jaw = body.jaw.at(context.time).x();
    state.power = body.description.path[body.tip.key_at(context.time)].power;
    const Vec3 shaft = body.description.trocar - state.tip;
    // A tip in its own trocar has no direction; it keeps the last one.
    if (shaft.norm() > 1e-9) state.shaft_direction = shaft.normalized();
    state.side_direction = Eigen::AngleAxisd(body.description.roll, state.shaft_direction) *
                           side_of(state.shaft_direction);
    state.started = true;
  }
}

}  // namespace viscera
