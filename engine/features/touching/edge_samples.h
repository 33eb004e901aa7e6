// Places along an organ's sharp edges that are asked whether they stand in another organ.
//
// Patches lie on faces, and where an edge comes down between two patches of the other organ, no
// patch of either meets anything until it has sunk in by as much as they lie apart.
#pragma once

#include <array>
#include <vector>

#include "engine/features/touching/drawn_organ.h"

namespace viscera {

/// A place of an edge stands in another organ by so much before it is pressed out: what patches
/// beside it hold, it leaves to them. Chosen: under what organs that touch may overlap [m].
inline constexpr double kEdgeMayStand = 0.15e-3;

/// Of a pair whose first organ brings these in place of its patches.
struct EdgeSamples {
  static constexpr bool kConstant = true;
  /// Triangles that meet at a place, one of them more than once where they are two.
  using Faces = std::array<int, 3>;
  std::vector<SurfacePatch> places;  ///< on the first of its faces, as wide as they lie apart, the
                                     ///< normal the mean of its faces'
  std::vector<Faces> faces;          ///< of each place
  Entity beside;                     ///< the same two organs' pair whose first brings patches
};

/// Along edges where the surface at rest turns outward by more than 60 degrees, corners first, no
/// nearer to each other than `pitch` [m]. Empty: it has no such edge.
EdgeSamples edge_samples(const TriangleSurface& surface, double pitch);

/// Whether any side of an edge, or what is between them, faces what has this normal there (world,
/// unit): less than this cosine.
bool edge_faces(const DrawnOrgan& organ, const EdgeSamples::Faces& faces, const Vec3& normal,
                double cosine);

}  // namespace viscera
