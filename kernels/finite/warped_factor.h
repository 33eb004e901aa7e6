// The factor of a body at rest as a preconditioner of the same body bent and turned: each node
// carries a rotation R of its own, and z = R P^-1 R^T g.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/finite/finite_state.h"

namespace viscera {

inline Eigen::Map<const Mat3> rotation_of(const NodalRotations& rotations, std::size_t node) {
  return Eigen::Map<const Mat3>(rotations.data() + 9 * node);
}

NodalRotations no_rotations(std::size_t nodes);

/// The rotation nearest to F; identity where F isn't finite or has lost its volume altogether.
Mat3 polar_rotation(const Mat3& f);

/// out = R P^-1 R^T g for vectors of 3 N, by a StiffnessFactor or a CompactFactor.
template <class Factor>
void apply_warped(const Factor& factor, const NodalRotations& rotations, std::span<const double> g,
                  std::span<double> out) {
  const std::size_t nodes = rotations.size() / 9;
  std::vector<double> turned(g.size());
  for (std::size_t node = 0; node < nodes; ++node)
    Vec3::Map(turned.data() + 3 * node).noalias() =
        rotation_of(rotations, node).transpose() * Vec3::Map(g.data() + 3 * node);
  factor.apply(turned, out);
  for (std::size_t node = 0; node < nodes; ++node) {
    const Vec3 z = rotation_of(rotations, node) * Vec3::Map(out.data() + 3 * node);
    Vec3::Map(out.data() + 3 * node) = z;
  }
}

}  // namespace viscera
