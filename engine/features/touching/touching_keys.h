// What a scene says of organs that touch each other.
#pragma once

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// An extra of scenes.
struct TouchingDescription {
  bool organs = false;    ///< they do
  bool folds = false;     ///< and each touches itself
  double friction = 0.0;  ///< coefficient of Coulomb friction between them
  double pitch = 0.5;     ///< of the patches by which they meet, over the distance of their nodes
};

const TouchingDescription& touching_of(const SceneDescription& scene);

FeatureKeys touching_keys();

}  // namespace viscera
