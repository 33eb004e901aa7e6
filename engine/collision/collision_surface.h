// Contact search by Embree's bounding-volume hierarchies; the only folder that knows Embree.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "kernels/points/surface.h"

namespace viscera {

/// One triangle surface that moves but keeps its triangles: closest points and rays.
/// Updated by the frame's thread, between queries; queries may come from many threads.
class CollisionSurface {
 public:
  CollisionSurface(const TriangleSurface& rest, std::span<const Vec3f> positions);
  ~CollisionSurface();
  CollisionSurface(CollisionSurface&&) noexcept;
  CollisionSurface& operator=(CollisionSurface&&) noexcept;

  /// New vertex positions [m]; refits the hierarchy (0.3 ms for 20,000 triangles).
  void update(std::span<const Vec3f> positions);

  struct Hit {
    SurfacePoint point;
    Vec3 position = Vec3::Zero();  ///< [m]
    double distance = 0.0;         ///< from the query point, or along the ray [m]
  };
  /// The nearest point of the surface within `radius` [m]; of those that `accepts` takes, which is
  /// asked with the nearest point of each triangle that may hold it. Empty: of all.
  std::optional<Hit> closest(const Vec3& query, double radius,
                             const std::function<bool(const Hit&)>& accepts = {}) const;
  /// The first crossing along the unit `direction` within `length` [m] where the surface faces the
  /// ray (outward normal against it) or, with `exits`, where the ray leaves the body.
  std::optional<Hit> cast(const Vec3& origin, const Vec3& direction, double length,
                          bool exits = false) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
