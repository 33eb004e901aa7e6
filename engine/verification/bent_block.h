// A block held at one end whose other end is moved aside, not turned, at finite strain: solved to
// the end by 27-node elements, which share nothing with the project's fields but the law at a
// point.
#pragma once

#include <array>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct BentBlockOptions {
  Vec3 size{80e-3, 20e-3, 20e-3};  ///< along x from end to end, y, z [m]
  Vec3 moved{0.0, 0.0, 30e-3};     ///< of the end at greatest x; in the plane y = 0 [m]
  IsotropicMaterial material{12e3, 0.45};
  int elements = 12;  ///< along x; a third of that across z, half of these across half of y
  int steps = 6;      ///< in which the end is moved
};

/// The block about the origin. Elements are smaller the nearer its ends and edges, where strains
/// have no bound.
class BentBlock {
 public:
  /// Newton's method, each step to 1e-9 of the force; fails where it finds no equilibrium. Seconds.
  static Result<BentBlock> solve(const BentBlockOptions& options);

  /// On the block by what moves its end [N].
  const Vec3& force() const { return force_; }
  /// Displacement of a place of the block at rest [m].
  Vec3 at(const Vec3& place) const;

 private:
  BentBlock() = default;

  std::array<std::vector<double>, 3> lines_;  // between elements [m]
  std::vector<Vec3> displacements_;           // of nodes, x fastest; y from 0 on
  Vec3 force_ = Vec3::Zero();
};

}  // namespace viscera
