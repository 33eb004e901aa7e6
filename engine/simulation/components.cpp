#include "engine/simulation/components.h"

namespace viscera {

FreeShape level_shape(const OrganModel& model) {
  FreeShape shape;
  shape.places.assign(model.displacement_rows(), 0.0f);
  shape.vertices.assign(model.rest_positions.size(), Vec3f::Zero());
  return shape;
}

void add_along_axes(std::span<const float> displacements, const Vec3& by,
                    std::vector<float>& places) {
  const std::size_t rows = places.size();
  const Vec3f way = by.cast<float>();
  for (std::size_t i = 0; i < rows; ++i)
    places[i] += way.x() * displacements[i] + way.y() * displacements[rows + i] +
                 way.z() * displacements[2 * rows + i];
}

}  // namespace viscera
