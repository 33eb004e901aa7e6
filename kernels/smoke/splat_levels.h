// The widths that the smoke of particles is splatted with. A kernel of radius r (a tent's, in
// cells: its variance is r^2/6 along each axis) is made of one of radius 1, which fills the eight
// cells around a particle, and blurs of the grid that all particles share: each widens what came so
// far to the next of a few levels. A particle between two levels is split among them so that the
// variance is its own. That costs sixteen cells a particle, however wide it is, where a tent of
// its own would fill (2 r)^3.
#pragma once

#include <vector>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

struct SplatLevel {
  float square = 1.0f;  ///< r^2 [cells^2]
  /// Of the blur along each axis that makes this level of the one before: of the cell itself, of
  /// each of its neighbours on either side, of the next ones, ... Whole multiples of 2^-24 that add
  /// up to 1, so that a blur neither makes nor takes smoke. Of the first level: 1.
  std::vector<float> weights = {1.0f};

  int reach() const { return static_cast<int>(weights.size()) - 1; }  ///< [cells]
};

/// Rising, from r = 1 to the widest that the parameters ask for; never empty.
std::vector<SplatLevel> splat_levels(const SplatParameters& parameters);

/// r^2 of a particle of this age [cells^2]
inline float splat_square(const SplatParameters& parameters, float age) {
  const float square = parameters.first_square + parameters.growth * age;
  const float cells = (square < parameters.widest_square ? square : parameters.widest_square) *
                      (parameters.inverse_voxel * parameters.inverse_voxel);
  constexpr float kMost = kWidestSplat * kWidestSplat;
  return cells < 1.0f ? 1.0f : cells > kMost ? kMost : cells;
}

}  // namespace viscera
