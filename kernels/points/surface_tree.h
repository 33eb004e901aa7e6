// Closest points and signed distances to a closed triangle surface: a bounding-volume tree for
// set-up work (node placement, wrapping). Contact inside the step uses Embree (engine/collision).
#pragma once

#include <memory>
#include <optional>

#include "kernels/points/surface.h"

namespace viscera {

/// Immutable; queries from many threads at once are safe. Keeps its own copy of the triangles.
class SurfaceTree {
 public:
  explicit SurfaceTree(const TriangleSurface& surface);
  ~SurfaceTree();
  SurfaceTree(SurfaceTree&&) noexcept;
  SurfaceTree& operator=(SurfaceTree&&) noexcept;

  struct Closest {
    SurfacePoint point;
    Vec3 position;    ///< [m]
    double distance;  ///< >= 0 [m]
  };
  Closest closest(const Vec3& query) const;
  /// Negative inside [m]; the sign from angle-weighted pseudo-normals [Baerentzen2005].
  double signed_distance(const Vec3& query) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
