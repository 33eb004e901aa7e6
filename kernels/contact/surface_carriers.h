// How displacements at the places of a surface carry the points between them.
#pragma once

#include <span>

#include "kernels/contact/surface_places.h"

namespace viscera {

/// Weights of the places about each point, as carry_surface (deformation.h) documents; `normals`
/// are unit, one a point. Rows add up to 1; a point without places in reach takes the nearest one.
/// Places beyond air carry nothing, but to a point that no other would; of another closed piece not
/// even then.
/// Parallel, deterministic.
SparseWeights surface_carriers(std::span<const Vec3> points, std::span<const Vec3> normals,
                               const SurfacePlaces& places);

}  // namespace viscera
