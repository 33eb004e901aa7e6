// What a blade takes on its way.
#pragma once

#include <array>

#include "kernels/parting/tissue_share.h"

namespace viscera {

/// An edge that has gone from one place to another, straight.
struct BladeSweep {
  std::array<Vec3, 2> before, now;  ///< the ends of its edge, at rest [m]
  double thickness = 0.0;           ///< of the blade [m]

  /// To what it has swept, negative inside [m]: of two triangles, rounded by half the thickness.
  double distance(const Vec3& place) const;
  Box reach() const;
};

/// Takes it out. A blade thinner than least_kerf() parts no more than one of that thickness would,
/// which is what is taken then. What has gone by this [m3].
double sweep(const BladeSweep& blade, TissueShare& tissue);

}  // namespace viscera
