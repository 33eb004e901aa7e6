// How large a burn is: what a ruler on a cut through it would say.
#pragma once

#include "kernels/base/fields.h"
#include "kernels/heat/bioheat.h"

namespace viscera {

/// Of coagulated tissue, Omega at least 1.
struct Lesion {
  double depth = 0.0;  ///< under the electrode [m]
  double width = 0.0;  ///< at the surface [m]
  static constexpr auto fields() {
    return std::tuple(field("depth", &Lesion::depth), field("width", &Lesion::width));
  }
};
static_assert(fields_cover<Lesion>());

/// Where Omega falls through `damage` below and beside a point of a surface that faces `outward`;
/// between voxels the logarithm of Omega is taken as linear.
Lesion lesion_at(const Bioheat& heat, const Vec3& point, const Vec3& outward, double damage = 1.0);

}  // namespace viscera
