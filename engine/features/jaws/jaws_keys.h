// What a scene says of a grasper's jaws: how hard they press, what their teeth rub, how the handle
// turns them.
#pragma once

#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// Of teeth against tissue where a scene doesn't say: with it 3.0 N on each jaw just hold a pull of
/// 5 N, the published figure; two jaws rub, so mu = 5 / (2 * 3.0).
inline constexpr double kTeethFriction = 5.0 / 6.0;

struct JawsDescription {
  struct Turn {
    double time = 0.0;   ///< [s]
    double angle = 0.0;  ///< [rad]
  };
  double force = 0.0;  ///< normal force of each jaw, the handle fully closed [N]
  double friction = kTeethFriction;
  std::vector<Turn> turns;  ///< about the shaft, beyond InstrumentDescription::roll; may be empty
};

/// Null: its jaws hold up to InstrumentDescription::grip_limit.
const JawsDescription* jaws_of(const InstrumentDescription& instrument);
void set_jaws(InstrumentDescription& instrument, const JawsDescription& jaws);

FeatureKeys jaws_keys();

}  // namespace viscera
