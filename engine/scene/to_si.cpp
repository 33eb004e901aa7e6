#include "engine/scene/to_si.h"

#include <numbers>

namespace viscera {

// Division rounds correctly where a product with 1e-3 doesn't: 2.5 mm is exactly 2.5e-3 m.
double from_milli(const Json& value) {
  return value.get<double>() / 1000.0;
}

double radians(const Json& degrees) {
  return degrees.get<double>() * std::numbers::pi / 180.0;
}

Vec3 vector_of(const Json& value) {
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

Vec3 from_milli_vector(const Json& value) {
  return vector_of(value) / 1000.0;
}

Vec3 direction_of(const Json& value) {
  return vector_of(value).normalized();
}

Fibres fibres_of(const Json& values) {
  return {direction_of(values["direction"]), 1000.0 * values["modulus_kPa"].get<double>()};
}

Box box_of(const Json& box) {
  return {from_milli_vector(box["min_mm"]), from_milli_vector(box["max_mm"])};
}

Region region_of(const Json& values) {
  Region region;
  if (values.contains("half_space")) {
    const Json& plane = values["half_space"];
    region.shape = Region::Shape::kHalfSpace;
    region.a = from_milli_vector(plane["point_mm"]);
    region.b = direction_of(plane["normal"]);
  } else if (values.contains("sphere")) {
    region.shape = Region::Shape::kSphere;
    region.a = from_milli_vector(values["sphere"]["centre_mm"]);
    region.radius = from_milli(values["sphere"]["radius_mm"]);
  } else {
    const Box box = box_of(values["box"]);
    region.shape = Region::Shape::kBox;
    region.a = box.min();
    region.b = box.max();
  }
  return region;
}

}  // namespace viscera
