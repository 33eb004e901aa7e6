// The published local scheme on a hive's nodes: linear moving least squares, every node's field an
// unknown, equilibrium collocated inside, tractions on the surface, displacements on the periphery
// [De2006] eq. 1-9. Kept to be compared with: its second derivatives are inconsistent, so its
// forces don't converge and its compliance isn't symmetric (see
// kernels/baselines/strong_forms/paper_formulation.cpp, which derives the same fields for whole
// bodies of any size; this one is for few nodes in constant memory).
#pragma once

#include "kernels/hive/hive_nodes.h"
#include "kernels/hive/interior_field.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

class CollocatedNodes {
 public:
  /// Takes all memory: dense, (3 nodes)^2.
  explicit CollocatedNodes(const HivePattern& pattern);

  int unknowns() const { return 3 * count_; }

  /// Displacement of the surface's free nodes per force on each [m/N], in the first 3 free_nodes
  /// rows and columns of `compliance`. `outside`: the periphery moves as this half-space; nullptr:
  /// not at all. False: the nodes carry no linear field somewhere, or the equations are singular.
  bool condense(const HivePattern& pattern, const HiveNodes& nodes,
                const IsotropicMaterial& material, const InteriorField* outside,
                Eigen::Ref<MatrixX> compliance) noexcept;

 private:
  bool evaluate(int node, std::span<const Vec3> positions, bool with_derivatives) noexcept;
  bool factor() noexcept;
  void solve(double* x) const noexcept;

  int count_ = 0;
  std::vector<double> spacings_;
  MatrixX matrix_, loads_;
  MatrixX surface_values_;  ///< of every node's field at the surface's free nodes
  std::vector<int> pivots_;
  // At one node: values, first and second derivatives of every node's field.
  std::vector<int> near_;
  std::vector<double> values_;
  std::vector<Vec3> gradients_;
  std::vector<Mat3> hessians_;
  std::vector<Vec4> basis_;
  std::vector<double> weights_;
};

}  // namespace viscera
