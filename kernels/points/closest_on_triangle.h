#pragma once

#include "kernels/base/types.h"

namespace viscera {

/// Weights of the corners at the place of triangle a b c nearest to p [Ericson2005] 5.1.5. Weights
/// of corners that don't belong to the feature it lies on are exactly zero.
Vec3 closest_weights(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace viscera
