// The table of a scene file's keys.
#pragma once

#include "engine/scene/feature_keys.h"

namespace viscera {

/// With what these features add. Vocabularies: "recipe", "tissue", "formulation".
ObjectSpec scene_keys(const std::vector<FeatureKeys>& features = {});

}  // namespace viscera
