// Places of an organ's surface that are asked whether they meet another organ: always the same
// ones, so that what the tissue answers there is put together once.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "engine/collision/collision_surface.h"
#include "kernels/base/fields.h"
#include "kernels/points/surface.h"

namespace viscera {

/// A patch of the surface at rest.
struct SurfacePatch {
  SurfacePoint point;
  Vec3 position = Vec3::Zero();  ///< of its middle [m]
  Vec3 normal = Vec3::UnitZ();   ///< unit, outward
  double area = 0.0;             ///< [m2]
  double height = 0.0;  ///< along the normal, of its mean place over its middle: below 0 where it
                        ///< bulges [m]
  Vec3 mean() const { return position + height * normal; }
  static constexpr auto fields() {
    using P = SurfacePatch;
    return std::tuple(field("point", &P::point), field("position", &P::position),
                      field("normal", &P::normal), field("area", &P::area),
                      field("height", &P::height));
  }
};
static_assert(fields_cover<SurfacePatch>());

/// Unit, outward; along z for a triangle without an area.
Vec3 face_normal(const TriangleSurface& surface, int triangle);

/// The patch of this area about a point of a surface at rest, with unit normals at its vertices;
/// `finder` finds on it.
SurfacePatch patch_at(const SurfacePoint& point, double area, const TriangleSurface& surface,
                      std::span<const Vec3f> normals, const CollisionSurface& finder);

/// Patches that share the surface out among them, their middles no nearer to each other than
/// `pitch` says there [m].
std::vector<SurfacePatch> patches_of(const TriangleSurface& surface, std::span<const Vec3f> normals,
                                     const CollisionSurface& finder,
                                     const std::function<double(const Vec3&)>& pitch);

}  // namespace viscera
