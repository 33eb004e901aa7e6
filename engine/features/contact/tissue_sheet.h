// An organ's surface as a tool is sought over it.
#pragma once

#include <optional>
#include <span>

#include "engine/simulation/components.h"

namespace viscera {

/// Interpolated at a place of the drawn surface.
Vec3 corner_mean(std::span<const Vec3f> values, const TriangleSurface& surface,
                 const SurfacePoint& point);

/// All in the organ's frame. Refers to what it was made of.
class TissueSheet {
 public:
  /// As it is drawn: with the dents of all tools.
  TissueSheet(const OrganModel& model, const OrganState& state, const CollisionSurface& drawn);
  /// As it would be without one tool's dent: the surface at rest, where `moved` has taken it.
  TissueSheet(const OrganModel& model, const CollisionSurface& rest, const Pose& moved);

  using Hit = CollisionSurface::Hit;
  /// The nearest place within `radius` [m].
  std::optional<Hit> closest(const Vec3& query, double radius) const;
  /// The first place where the surface faces the ray along the unit `direction`, within `length`
  /// [m].
  std::optional<Hit> cast(const Vec3& origin, const Vec3& direction, double length) const;
  Vec3 position(const SurfacePoint& point) const;  ///< [m]
  Vec3 normal(const SurfacePoint& point) const;    ///< unit

 private:
  const OrganModel& model_;
  const OrganState* state_ = nullptr;  // null: at rest
  const CollisionSurface& surface_;
  Pose moved_;
};

}  // namespace viscera
