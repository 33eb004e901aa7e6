// Elastic stiffness of the wedges between a hive's nodes, condensed layer by layer to its surface.
//
// Weak form on six-node wedges, two points each, dilatation taken as its mean over the wedge, so
// that nearly incompressible tissue doesn't lock. Layers couple only to their neighbours, so the
// lowest is eliminated first and each step is a dense block of one layer: S_l = D_l - O_l
// S_(l+1)^-1 O_l^T.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/hive/hive_nodes.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// All memory is taken by the constructor.
class LayeredStiffness {
 public:
  /// Free unknowns: those of the nodes off the periphery, b = 3 free_nodes a layer. `loads`: most
  /// columns of a solve.
  LayeredStiffness(const HivePattern& pattern, int loads);

  int unknowns() const { return block_ * (layers_ - 1); }

  /// Stiffness of the wedges about these nodes (layer by layer). `held`: displacements of the
  /// periphery's nodes, as rows of 3 per node and one column a load case, (3 nodes) x loads; rows
  /// of free nodes aren't read; empty: zero. False where a wedge is turned inside out.
  bool assemble(const HivePattern& pattern, std::span<const Vec3> positions,
                const IsotropicMaterial& material, const MatrixX* held) noexcept;

  /// Displacements of the surface's free nodes under `loads` on them [N], b x n in place [m], with
  /// what the held periphery adds. False: not positive definite.
  bool solve(Eigen::Ref<MatrixX> loads) noexcept;

 private:
  bool add_wedge(const std::array<int, 6>& nodes, std::span<const Vec3> positions,
                 const IsotropicMaterial& material, const MatrixX* held) noexcept;
  double* block(int layer) {
    return blocks_.data() + static_cast<std::size_t>(layer * 2 * block_ * block_);
  }

  int ring_ = 0, free_ = 0, layers_ = 0, block_ = 0, loads_ = 0;
  std::vector<double> blocks_;  ///< of each free layer D_l and O_l (to the layer below), b x b
  std::vector<double> sides_;   ///< of each free layer the loads from the held periphery, loads x b
  std::vector<double> front_;   ///< the front of the elimination, (2 b + loads) x 2 b
  bool held_ = false;
};

}  // namespace viscera
