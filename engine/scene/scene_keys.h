// The table of a scene file's keys.
#pragma once

#include "engine/scene/keys.h"

namespace viscera {

/// One object for the life of the program. Vocabularies: "recipe", "tissue", "formulation".
const ObjectSpec& scene_keys();

}  // namespace viscera
