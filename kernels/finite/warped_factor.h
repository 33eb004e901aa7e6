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

/// out = R P^-1 R^T g for columns of 3 N one after another, by any factor. A CompactFactor is read
/// once for all of them.
template <class Factor>
void apply_warped(const Factor& factor, const NodalRotations& rotations, std::span<const double> g,
                  std::span<double> out) {
  const std::size_t nodes = rotations.size() / 9, columns = g.size() / (3 * nodes);
  std::vector<double> turned(g.size());
  for (std::size_t at = 0; at < columns * nodes; ++at)
    Vec3::Map(turned.data() + 3 * at).noalias() =
        rotation_of(rotations, at % nodes).transpose() * Vec3::Map(g.data() + 3 * at);
  const std::span<const double> from(turned);
  if constexpr (requires { factor.apply(from, out, columns); }) {
    factor.apply(from, out, columns);
  } else {
    for (std::size_t c = 0; c < columns; ++c)
      factor.apply(from.subspan(3 * nodes * c, 3 * nodes), out.subspan(3 * nodes * c, 3 * nodes));
  }
  for (std::size_t at = 0; at < columns * nodes; ++at) {
    const Vec3 z = rotation_of(rotations, at % nodes) * Vec3::Map(out.data() + 3 * at);
    Vec3::Map(out.data() + 3 * at) = z;
  }
}

}  // namespace viscera
