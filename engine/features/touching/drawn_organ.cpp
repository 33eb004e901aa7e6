#include "engine/features/touching/drawn_organ.h"

#include "engine/features/contact/tissue_sheet.h"

namespace viscera {

DrawnOrgan::DrawnOrgan(const World& world, Entity organ)
    : state(*world.find<OrganState>(organ)),
      surface(world.find<OrganBody>(organ)->model->surface),
      pose(pose_of(world, organ)) {}

Vec3 DrawnOrgan::place_in_organ(const SurfacePoint& point) const {
  return corner_mean(state.positions, surface, point);
}

Vec3 DrawnOrgan::normal_in_organ(int triangle) const {
  const auto& corners = surface.triangles[static_cast<std::size_t>(triangle)];
  const auto at = [&](std::size_t c) {
    return state.positions[static_cast<std::size_t>(corners[c])].cast<double>();
  };
  const Vec3 across = (at(1) - at(0)).cross(at(2) - at(0));
  const double length = across.norm();
  return length > 0.0 ? Vec3(across / length) : Vec3(Vec3::Zero());
}

Vec3 DrawnOrgan::displacement(const SurfacePatch& patch) const {
  return pose.direction_to_world(place_in_organ(patch.point) - patch.position);
}

}  // namespace viscera
