// The round, stiff part of an instrument behind its working end, and that of the endoscope.
#pragma once

#include "engine/simulation/components.h"

namespace viscera {

/// In some frame: world, or an organ's. The same `along` is the same place of the shaft, whatever
/// it does.
struct ShaftAxis {
  Vec3 begin = Vec3::Zero();       ///< where it begins, next to the tip [m]
  Vec3 direction = Vec3::UnitZ();  ///< unit, away from the tip
  double length = 0.0;             ///< to the trocar [m]
  Vec3 at(double along) const { return begin + along * direction; }
  static constexpr auto fields() {
    return std::tuple(field("begin", &ShaftAxis::begin), field("direction", &ShaftAxis::direction),
                      field("length", &ShaftAxis::length));
  }
};
static_assert(fields_cover<ShaftAxis>());

/// The same in the frame that `pose` places in this one's.
ShaftAxis in_frame(const ShaftAxis& axis, const Pose& pose);

/// Where the round part begins in the instrument's frame, as it is drawn
/// (engine/render/instrument_mesh.h).
struct ShaftBegin {
  double along = 0.0;  ///< from the tip, along the shaft [m]
  double aside = 0.0;  ///< against the instrument's side: a hook's shaft is set back [m]
};
ShaftBegin shaft_begin(const InstrumentBody& body);

/// Of an instrument that stands so; world.
ShaftAxis shaft_axis(const InstrumentBody& body, const InstrumentState& state);

}  // namespace viscera
