// The list of features: what the simulator is made of.
#pragma once

#include "engine/simulation/schedule.h"

namespace viscera {

/// In the order in which they are prepared and started, and which decides where stages leave a
/// choice.
const std::vector<Feature>& all_features();
/// The order of their stages.
const Schedule& step_schedule();
/// The keys that they add to a scene.
const std::vector<FeatureKeys>& feature_keys();

}  // namespace viscera
