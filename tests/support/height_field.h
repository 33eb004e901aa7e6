// Open surfaces whose heights and slopes one can write down.
#pragma once

#include <functional>

#include "kernels/points/surface.h"

namespace viscera::test {

/// z = height(x, y) over a square about the origin, of so many squares along an edge with sides of
/// `side` [m], each two triangles; upwards is outward.
TriangleSurface height_field(int squares, double side,
                             const std::function<double(double x, double y)>& height);

}  // namespace viscera::test
