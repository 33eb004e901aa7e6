// The part of the scene format that tells how an organ's tissue answers a held tool beyond small,
// slow strains.
#pragma once

#include "engine/scene/keys.h"
#include "engine/scene/scene.h"

namespace viscera {

ObjectSpec material_keys();
/// Of a sound object.
MaterialDescription material_of(const Json& values);

}  // namespace viscera
