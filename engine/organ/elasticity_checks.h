// Whether an organ's elasticity can be prepared, as far as that can be told without nodes.
#pragma once

#include "engine/scene/scene.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Fails, saying what to change, where the formulation doesn't take the material, or where no fixed
/// region meets the surface [m, in the organ's frame]. Lenient: a region that meets it so narrowly
/// that it holds nothing is found only by preparing.
Result<void> check_elasticity(const OrganDescription& organ, const IsotropicMaterial& material,
                              const TriangleSurface& surface);

}  // namespace viscera
