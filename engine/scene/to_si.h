// From the values of a checked scene file to SI.
#pragma once

#include "engine/scene/json_file.h"
#include "engine/scene/region.h"
#include "kernels/base/types.h"
#include "kernels/paff/fibres.h"

namespace viscera {

double from_milli(const Json& value);
double radians(const Json& degrees);
Vec3 vector_of(const Json& value);
Vec3 from_milli_vector(const Json& value);
/// Unit.
Vec3 direction_of(const Json& value);
Fibres fibres_of(const Json& values);
/// Of min_mm and max_mm.
Box box_of(const Json& box);
/// Of a half space, a sphere or a box.
Region region_of(const Json& values);

}  // namespace viscera
