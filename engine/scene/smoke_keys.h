// The part of the scene format that tells of smoke and of the gas that carries it.
#pragma once

#include "engine/scene/keys.h"

namespace viscera {

ObjectSpec smoke_keys();
ObjectSpec gas_keys();

/// Of a whole scene: an emitter that names an instrument names a hook.
ObjectCheck emitters_burn();
/// Of a whole scene: where gas comes and goes lies in the flow's domain.
ObjectCheck openings_in_domain();

}  // namespace viscera
