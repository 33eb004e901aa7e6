// Closed, outward-oriented surfaces for tests, centred at the origin.
#pragma once

#include "kernels/points/surface.h"

namespace viscera::test {

/// A sphere [m] of 20 * 4^subdivisions triangles whose vertices lie on it.
TriangleSurface icosphere(double radius, int subdivisions);

/// An axis-aligned box of these edges [m], each face split into divisions x divisions squares of
/// two triangles.
TriangleSurface box(const Vec3& edges, int divisions);

/// A cube of this edge [m], each face split into n x n squares of two triangles.
TriangleSurface cube(double edge, int n);

}  // namespace viscera::test
