// The factor of a body at rest as a preconditioner of the same body bent and turned: each node
// carries a rotation R of its own, and z = R P^-1 R^T g.
#pragma once

#include <memory>
#include <span>

#include "kernels/base/types.h"
#include "kernels/finite/finite_state.h"
#include "kernels/paff/compact_factor.h"

namespace viscera {

inline Eigen::Map<const Mat3> rotation_of(const NodalRotations& rotations, std::size_t node) {
  return Eigen::Map<const Mat3>(rotations.data() + 9 * node);
}

NodalRotations no_rotations(std::size_t nodes);

/// The rotation nearest to F; identity where F isn't finite or has lost its volume altogether.
Mat3 polar_rotation(const Mat3& f);

/// out = R P^-1 R^T g for vectors of 3 N.
void apply_warped(const CompactFactor& factor, const NodalRotations& rotations,
                  std::span<const double> g, std::span<double> out);

}  // namespace viscera
