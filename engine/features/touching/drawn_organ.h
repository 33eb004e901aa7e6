// An organ as its drawn surface stands, for whoever seeks where it meets something.
#pragma once

#include "engine/features/touching/meeting_samples.h"
#include "engine/simulation/world.h"

namespace viscera {

/// Refers to the world that it was made of.
struct DrawnOrgan {
  const OrganState& state;
  const TriangleSurface& surface;
  const Pose& pose;

  DrawnOrgan(const World& world, Entity organ);

  Vec3 place_in_organ(const SurfacePoint& point) const;  ///< its frame [m]
  Vec3 normal_in_organ(int triangle) const;  ///< its frame, of a triangle that has an area: unit
  Vec3 place(const SurfacePoint& point) const { return pose.to_world(place_in_organ(point)); }
  Vec3 normal(int triangle) const { return pose.direction_to_world(normal_in_organ(triangle)); }
  /// By what moves its points from their rest, world [m].
  Vec3 displacement(const SurfacePatch& patch) const;
};

}  // namespace viscera
