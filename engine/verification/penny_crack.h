// A crack like a coin in the middle of a block, under pressure: how far its faces open is known
// exactly where the body is without end [Sneddon1946]. The block is held all around, so far away
// that it changes little.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct PennyCrack {
  double radius = 5e-3;     ///< c [m]
  double pressure = 100.0;  ///< on both faces [Pa]
  IsotropicMaterial material{10e3, 0.45};
  double spacing = 1.25e-3;  ///< of the nodes at the crack, from where it grows [m]
  double coarse = 4e-3;      ///< at most [m]
  double half = 25e-3;       ///< of the block's edge [m]
  std::uint64_t seed = 1;

  /// 8 (1 - nu^2) s sqrt(c^2 - r^2) / (pi E), of both faces together [m].
  double exact_opening(double r) const;
};

struct PennyOpening {
  double r = 0.0;        ///< from the axis [m]
  double opening = 0.0;  ///< of both faces, mean over directions [m]
};
struct OpenedCrack {
  std::vector<PennyOpening> openings;  ///< from the axis outwards; the first is the centre's
  std::size_t nodes = 0, twins = 0;
  double seconds = 0.0;  ///< to place nodes, assemble and solve
};

/// Fails where the body can't be assembled or solved.
Result<OpenedCrack> open_crack(const PennyCrack& crack);

}  // namespace viscera
