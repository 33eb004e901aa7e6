// Refinement of imported surfaces, so that a coarse organ has no facets.
#include "engine/organ/shape.h"
#include "kernels/points/curved_refinement.h"

namespace viscera {

TriangleSurface refined(const TriangleSurface& surface, double edge) {
  const CurvedRefinement refinement(
      surface, [edge](const Vec3& a, const Vec3& b, const Vec3&) { return (a - b).norm() > edge; });
  TriangleSurface fine{surface.vertices, refinement.triangles()};
  std::vector<Vec3> normals = vertex_normals(surface);
  refinement.extend(fine.vertices, normals);
  return fine;
}

}  // namespace viscera
