// Plain organs of tissue "rubber", of which scenes for tests and benchmarks are built.
#pragma once

#include <string>

#include "engine/scene/scene.h"

namespace viscera {

/// A block from corner to corner [m] that doesn't deform.
OrganDescription still_block(const std::string& name, const Vec3& from, const Vec3& to);

/// One that nothing holds, its middle there [m]; nodes `spacing` apart [m].
OrganDescription free_rubber(const std::string& name, const RecipeGeometry& geometry,
                             const Vec3& middle, double spacing);

}  // namespace viscera
