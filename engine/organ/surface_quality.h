// What a surface is like, and where it is at its worst.
#pragma once

#include "kernels/points/surface.h"

namespace viscera {

struct SurfaceQuality {
  double volume = 0.0, area = 0.0;  ///< [m3], [m2]
  Box box;                          ///< [m]
  int genus = 0;                    ///< handles: 0 for a ball, 1 for a ring
  double least_angle = 0.0;         ///< of all triangles [rad]
  Vec3 least_angle_place = Vec3::Zero();
  double shortest_edge = 0.0, longest_edge = 0.0;  ///< [m]
  double thinnest_wall = 0.0;  ///< across the body between two sides [m]; 0: not found
  Vec3 thinnest_place = Vec3::Zero();
  double thin_share = 0.0;  ///< of the area whose wall is thinner than asked about
};

/// Of a closed surface. A wall is as thick as it is far from a vertex inwards to a side that faces
/// it within 60 degrees, at up to 4,000 vertices; a quarter of an edge is the least that is told.
/// `thin`: walls below this count for thin_share [m].
SurfaceQuality measure_quality(const TriangleSurface& surface, double thin);

/// How deep one body's vertices lie in another: the greatest depth of `a` in `b` and of `b` in `a`.
struct Overlap {
  double depth = 0.0;  ///< [m]; 0: none
  Vec3 place = Vec3::Zero();
};
Overlap greatest_overlap(const TriangleSurface& a, const TriangleSurface& b);

}  // namespace viscera
