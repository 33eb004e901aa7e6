#include "engine/simulation/components.h"

namespace viscera {

FreeShape level_shape(const OrganModel& model) {
  FreeShape shape;
  shape.places.assign(model.displacement_rows(), 0.0f);
  shape.vertices.assign(model.rest_positions.size(), Vec3f::Zero());
  return shape;
}

}  // namespace viscera
