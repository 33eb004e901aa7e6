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

/// Where a surface turns outward by more than 60 degrees.
struct SharpEdge {
  std::array<int, 2> vertices{};
  std::array<int, 2> faces{};   ///< its triangles
  Vec3 normal = Vec3::UnitZ();  ///< unit, between both
};
std::vector<SharpEdge> sharp_edges(const TriangleSurface& surface);

/// Of a pair whose first organ brings these in place of its patches.
struct EdgeSamples {
  static constexpr bool kConstant = true;
  /// Triangles that meet at a place, the last of them twice where they are two.
  using Faces = std::array<int, 3>;
  std::vector<SurfacePatch> places;  ///< on the first of its faces, as wide as they lie apart, the
                                     ///< normal the mean of its faces'
  std::vector<Faces> faces;          ///< of each place
  Entity beside;                     ///< the same two organs' pair whose first brings patches
};

/// Along the sharp edges of a surface at rest, corners first. None is nearer than `pitch` [m] to
/// another that faces as it does, nor a corner than half of it to another corner.
EdgeSamples edge_samples(const TriangleSurface& surface, const std::vector<SharpEdge>& edges,
                         double pitch);

/// Whether any side of an edge, or what is between them, faces what has this normal there (world,
/// unit): less than this cosine.
bool edge_faces(const DrawnOrgan& organ, const EdgeSamples::Faces& faces, const Vec3& normal,
                double cosine);

}  // namespace viscera
