// Bodies that are lifted or bent by one end: what finite strain is for.
#pragma once

#include <functional>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

enum class LiftedShape {
  kGallbladder,  ///< an ellipsoid of 90 x 35 x 35 mm along x, held where x < -15 mm, by its far
                 ///< pole
  kBar,          ///< a block of 80 x 20 x 20 mm along x, both ends held and kept flat
  kSlenderBar,   ///< 100 x 5 x 5 mm, held at one end, the other's mean held: that end may turn
  kTube,         ///< 80 mm along x, radii 7 and 10 mm, held at one end, the rim of the other held
};

struct LiftShape {
  TriangleSurface surface;
  std::function<bool(const Vec3&)> is_held;
  std::vector<Vec3> grip;   ///< places of the tissue that are moved [m]
  bool holds_mean = false;  ///< their mean alone is
};

LiftShape lift_shape(LiftedShape shape);

/// Along x and z as an ellipse about the origin, from `rings` rings of triangles between its poles.
TriangleSurface ellipsoid(const Vec3& half_axes, int rings);

}  // namespace viscera
