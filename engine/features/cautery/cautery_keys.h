// What a scene says of current and heat.
#pragma once

#include <optional>
#include <string>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"
#include "kernels/heat/electrode.h"

namespace viscera {

/// What is published of burns like the one that a scene makes; as far as it is.
struct PublishedLesion {
  std::optional<double> least_depth, most_depth, least_width, most_width;  ///< [m]
  std::string source;
};

struct HeatDescription {
  double voxel = 0.5e-3;  ///< of the bricks in which heat spreads [m]
  std::string lesion_of;  ///< a hook whose first burn is measured; empty: none is
  std::optional<PublishedLesion> published;  ///< beside that
};

/// Of organs whose burning is a mistake of the trainee's, which reports count.
struct Spared {};

/// An extra of graspers with `grip_force_N` whose jaws seal what they hold.
struct BipolarDescription {
  double holds = 48e3;  ///< pressure that a seal bears [Pa]
  double blade = 0.0;   ///< a knife between them begins so far behind the tip [m]; 0: there is none
};

const HeatDescription& heat_of(const SceneDescription& scene);
bool is_spared(const OrganDescription& organ);
/// Of the generator of a hook, a spatula or scissors; an extra of instruments.
CurrentMode mode_of(const InstrumentDescription& hook);
/// Null: its jaws carry no current.
const BipolarDescription* bipolar_of(const InstrumentDescription& tool);
/// True for a hook, a spatula, scissors, or jaws that seal, with current at some time.
bool carries_current(const InstrumentDescription& tool);

FeatureKeys cautery_keys();

}  // namespace viscera
