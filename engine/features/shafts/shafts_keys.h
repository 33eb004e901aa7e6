// What a scene says of shafts that touch organs or each other.
#pragma once

#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// An extra of scenes.
struct ShaftsDescription {
  bool touch = false;              ///< they do, and so does the endoscope's barrel
  double endoscope_radius = 5e-3;  ///< of the barrel; 0: it touches nothing [m]
  bool tools = false;              ///< instruments press each other, and the barrel
};

const ShaftsDescription& shafts_of(const SceneDescription& scene);

/// Their part of the scene's "contact".
std::vector<KeySpec> shaft_keys_of_contact();
FeatureKeys shafts_keys();

}  // namespace viscera
