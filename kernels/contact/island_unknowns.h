// The unknown forces between the bodies of an island.
#pragma once

#include <array>
#include <cstddef>

#include "kernels/base/types.h"

namespace viscera {

/// A dense matrix of more unknowns isn't made: of these it takes 300 MB.
inline constexpr std::size_t kMostDenseUnknowns = 6000;

/// What one unknown amount of force does to one body: along a direction of its frame.
struct IslandTerm {
  int body = -1;  ///< none
  int cell = 0;
  Vec3 along = Vec3::Zero();
};

/// One amount of force: on one body, or on two, opposite.
struct IslandUnknown {
  std::array<IslandTerm, 2> terms;
  double softness = 0.0;  ///< of what lies between [m/N]
};

}  // namespace viscera
