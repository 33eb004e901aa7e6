#include "engine/features/shafts/shaft_axis.h"

#include <algorithm>

#include "engine/features/parting/parting_keys.h"

namespace viscera {

ShaftAxis in_frame(const ShaftAxis& axis, const Pose& pose) {
  return {pose.to_local(axis.begin), pose.direction_to_local(axis.direction), axis.length};
}

ShaftBegin shaft_begin(const InstrumentBody& body) {
  const InstrumentDescription& tool = body.description;
  if (!body.mesh.empty()) {
    ShaftBegin begin;
    for (const Vec3& vertex : body.mesh.vertices) begin.along = std::max(begin.along, vertex.z());
    return begin;
  }
  ShaftBegin begin;
  switch (tool.kind) {
    case InstrumentKind::kProbe:
      begin.along = 6.0 * std::max(tool.tip.radius, tool.shaft_radius);
      break;
    case InstrumentKind::kHook:
      begin = {16.5e-3, 4.5e-3};
      break;
    case InstrumentKind::kSpatula:
      begin.along = 16.5e-3;
      break;
    case InstrumentKind::kScalpel:
    case InstrumentKind::kScissors:
      begin.along = blade_of(tool) ? blade_of(tool)->length + 8e-3 : 16.5e-3;
      break;
    case InstrumentKind::kGrasper:
    case InstrumentKind::kClipApplier:
      begin.along = 15.5e-3;  // its jaws are as wide as the shaft from there
      break;
    case InstrumentKind::kBag:
      break;  // the ring lies beyond the tip
  }
  // What the tip touches is the tip's.
  const double tip = tool.tip.shape == TipDescription::Shape::kCapsule ? tool.tip.length : 0.0;
  begin.along = std::max(begin.along, tip + tool.tip.radius);
  return begin;
}

ShaftAxis shaft_axis(const InstrumentBody& body, const InstrumentState& state) {
  const ShaftBegin begin = shaft_begin(body);
  ShaftAxis axis;
  axis.begin = state.tip + begin.along * state.shaft_direction - begin.aside * state.side_direction;
  axis.direction = state.shaft_direction;
  axis.length = std::max(0.0, (body.description.trocar - state.tip).norm() - begin.along);
  return axis;
}

}  // namespace viscera
