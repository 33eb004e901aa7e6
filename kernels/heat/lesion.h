// How large a burn is: what a ruler on a cut through it would say.
#pragma once

#include "kernels/base/fields.h"
#include "kernels/heat/bioheat.h"

namespace viscera {

/// What a burn's edge is the edge of.
enum class LesionOf {
  kCoagulated,  ///< blanched tissue: Omega of coagulation at least 1
  kDead,        ///< that, or tissue with the lethal dose of heat: what histology finds days later
};

struct Lesion {
  double depth = 0.0;  ///< under the electrode [m]
  double width = 0.0;  ///< at the surface [m]
  static constexpr auto fields() {
    return std::tuple(field("depth", &Lesion::depth), field("width", &Lesion::width));
  }
};
static_assert(fields_cover<Lesion>());

/// Where that falls through 1 below and beside a point of a surface that faces `outward`; between
/// voxels the logarithm of Omega or dose is taken as linear.
Lesion lesion_at(const Bioheat& heat, const Vec3& point, const Vec3& outward,
                 LesionOf what = LesionOf::kCoagulated);

}  // namespace viscera
