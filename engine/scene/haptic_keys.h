// The part of the scene format that tells of tools that are held.
#pragma once

#include "engine/scene/keys.h"

namespace viscera {

ObjectSpec haptic_keys();

}  // namespace viscera
