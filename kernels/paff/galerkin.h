// The `galerkin` formulation: point-associated finite fields [De2006] in the weak form [De2000]
// [Belytschko1994], integrated with symmetric variational consistency (consistent_gradients.h) and
// held by Nitsche's method [Nitsche1971]. Its stiffness is symmetric positive definite.
//
// What lambda exceeds that of Poisson's ratio 0.3 acts on the dilatation averaged over cells
// (mean_dilatation.h), in both bases: all of it from 0.4 on, below a share that falls to nothing at
// 0.3. On a thick sphere of 605 nodes under inner pressure the error is then 3.9 % at 0.3, 5.5 % at
// 0.45, 7.0 % at 0.49 and 7.7 % at 0.499 (pointwise: 66 % at 0.499). It doubles the entries of the
// stiffness, and the factor grows by a third to a half. Walls with no nodes inside (1.5 spacings
// and less) still lock: a spherical shell one spacing thick errs by 3 %, 11 % and 29 % at 0.3, 0.45
// and 0.49; one of 1.6 spacings, which has some, by 1 %, 3 % and 5 %.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "kernels/paff/block_matrix.h"
#include "kernels/paff/cut_cells.h"
#include "kernels/paff/elastic_region.h"
#include "kernels/paff/elasticity.h"
#include "kernels/paff/mean_dilatation.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/paff/sparse_cholesky.h"
#include "kernels/paff/surface_quadrature.h"
#include "kernels/paff/tissue_pieces.h"

namespace viscera {

/// The fixed points of the surface with the shape functions there and Nitsche's penalty.
struct FixedPoints {
  std::vector<std::size_t> points;  ///< index into the SurfaceQuadrature
  PointFields fields;
  std::vector<double> rate;  ///< [1/m]
};

/// Whether part of lambda acts on averaged dilatation.
bool averages_dilatation(const IsotropicMaterial& material);

/// The assembled equations K alpha = f of one body, of its nodes and their twins
/// (fields().cloud()): N counts both. Benchmarks with known solutions use it directly; scenes go
/// through the Formulation.
class GalerkinSystem {
 public:
  /// Errors as documented at Formulation::prepare; the surface may be dropped afterwards.
  static Result<GalerkinSystem> assemble(const ElasticProblem& problem, double support_factor,
                                         const Progress& progress) {
    return assemble(problem, Basis::kLinear, support_factor, progress);
  }
  static Result<GalerkinSystem> assemble(const ElasticProblem& problem, Basis basis,
                                         double support_factor, const Progress& progress);

  /// Right-hand side f (3 N, node-major) [N], by the same points and the same Nitsche terms as K.
  std::vector<double> loads(const StaticLoads& loads) const;

  /// Solves for one set of loads: the nodal unknowns alpha (3 N) [m].
  Result<std::vector<double>> solve(const StaticLoads& loads) const;

  /// Displacement at x of the unknowns alpha, sum_J phi_J(x) alpha_J [m]; NaN where no field
  /// reaches.
  Vec3 displacement(std::span<const double> unknowns, const Vec3& x) const;

  Result<SparseCholesky> factor() const;

  /// As RegionSolver::region (elastic_region.h).
  Result<ElasticRegion> region(const std::function<bool(const Vec3&)>& wanted) const;

  /// What holding the body adds to its stiffness (Nitsche's terms) [N/m].
  Result<SymmetricBlockMatrix> hold() const;

  const SymmetricBlockMatrix& stiffness() const { return stiffness_; }
  const ShapeFunctions& fields() const { return *fields_; }
  const VolumeQuadrature& volume() const { return volume_; }
  const SurfaceQuadrature& surface() const { return surface_; }
  const PreparationFigures& figures() const { return figures_; }
  /// More than one where air parts the body; those that nothing holds are there only where the
  /// problem lets them be.
  const std::vector<TissuePiece>& pieces() const { return pieces_; }

 private:
  GalerkinSystem() = default;
  /// Nitsche's part of the right-hand side.
  void add_held(const StaticLoads& loads, std::vector<double>& all) const;
  void add_cells(std::span<const std::size_t> numbers, ElasticRegion& region) const;
  /// Points with the relative modulus in their weights: what integrates energies, and bounds them.
  VolumeQuadrature weighed_volume() const;
  SurfaceQuadrature weighed_surface() const;

  IsotropicMaterial material_;
  std::shared_ptr<const ShapeFunctions> fields_;
  VolumeQuadrature volume_;
  SurfaceQuadrature surface_;
  /// Relative modulus at points of the volume, and of the surface that is held; empty: 1.
  std::vector<double> modulus_, held_modulus_;
  std::vector<Fibres> fibres_, held_fibres_;  ///< there; empty: none
  std::vector<double> multipliers_;           ///< that made the gradients consistent
  FixedPoints fixed_;
  /// At the points of the volume, consistent; kept of few points (ElasticProblem), whose regions
  /// are of all of them. Values aren't.
  PointFields inside_;
  MeanDilatation dilatation_;
  std::vector<TissuePiece> pieces_;
  SymmetricBlockMatrix stiffness_;  ///< [N/m]
  PreparationFigures figures_;
};

/// The formulation "galerkin": linear basis, support factor 1.8.
const Formulation& galerkin_formulation();

/// The formulation "galerkin_quadratic": quadratic basis, support factor 2.4. More accurate on
/// smooth fields than any refinement of the linear one at the same cost; needs bodies some four
/// nodes thick.
const Formulation& galerkin_quadratic_formulation();

}  // namespace viscera
