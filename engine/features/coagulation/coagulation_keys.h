// What a scene says of an organ whose tissue coagulates.
#pragma once

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// Of organs whose tissue stays as it is where it coagulates.
struct NeverStiffens {};

/// Whether coagulated tissue of it becomes stiffer and shrinks.
bool stiffens(const OrganDescription& organ);

FeatureKeys coagulation_keys();

}  // namespace viscera
