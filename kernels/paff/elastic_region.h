// What a part of a body is made of, point by point: what it takes to say how its stiffness and its
// shape follow when tissue there changes after the body was prepared.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/paff/block_matrix.h"
#include "kernels/paff/fibres.h"
#include "kernels/paff/tissue_pieces.h"

namespace viscera {

/// Quadrature points q of the weak form with consistent gradients g~ there, and where the
/// dilatation is averaged (mean_dilatation.h) the cells c that they lie in, psi_k(y_q) and the rows
/// G_k of these. With f_q and e_q (linear strain without stress) the body's elastic energy is
///   1/2 sum_q w f (2 mu |eps(u) - e I|^2 + lambda (div u - 3 e)^2 + averaged (dil u - 3 e)^2),
///   dil u = sum_k psi_k(y_q) sum_J G_kJ . u_J
/// The moduli are those of the material; where they change from place to place, w has that in it.
/// Fibres of the modulus E along a add 1/2 sum_q V f E (a . eps(u) a - e)^2, V being volumes.
/// The hold (Nitsche) keeps the sound tissue's values: with f = 4 right at it, it yields by some 3
/// % of what the tissue stretches over a spacing.
struct ElasticRegion {
  static constexpr std::size_t kTerms = 4;  ///< psi of a cell

  double shear_modulus = 0.0;     ///< mu [Pa]
  double pointwise_lambda = 0.0;  ///< lambda [Pa]
  double averaged_lambda = 0.0;   ///< 0: nothing is averaged [Pa]

  std::vector<int> nodes;  ///< of the cloud, that the points or their cells reach, ascending    (n)
  std::vector<Vec3> positions;  ///< rest [m]                                              (Q)
  /// Volume times relative modulus: what integrates energies                          (Q) [m3]
  std::vector<double> weights;
  /// Relative modulus; empty: 1                                                             (Q)
  std::vector<double> modulus;
  std::vector<Fibres> fibres;         ///< empty: there are none                       (Q)
  std::vector<std::size_t> begin{0};  ///< of each point's entries                           (Q + 1)
  std::vector<int> point_nodes;       ///< index into `nodes`                              (entries)
  std::vector<Vec3> gradients;        ///< g~ [1/m]                                        (entries)

  std::vector<int> cell;                   ///< of each point; empty: nothing is averaged        (Q)
  std::vector<double> psi;                 ///< [m^-1.5]                                (Q x kTerms)
  std::vector<std::size_t> cell_begin{0};  ///<                                              (C + 1)
  std::vector<int> cell_nodes;             ///< index into `nodes`                    (cell entries)
  /// G [sqrt(m)]; of cell c the rows k = 0 ... kTerms - 1 one after another, from
  /// kTerms * cell_begin[c] on.                                            (kTerms x cell entries)
  std::vector<Vec3> cell_gradients;

  std::size_t size() const { return weights.size(); }
  double volume(std::size_t q) const {  ///< [m3]
    return modulus.empty() ? weights[q] : weights[q] / modulus[q];
  }
  std::size_t cells() const { return cell_begin.size() - 1; }
  std::size_t memory_bytes() const;
};

/// Solvers that know their regions.
class RegionSolver {
 public:
  virtual ~RegionSolver() = default;
  /// The quadrature points for which `wanted` holds, in their order.
  virtual Result<ElasticRegion> region(const std::function<bool(const Vec3&)>& wanted) const = 0;
  /// What holding the body adds to its stiffness [N/m].
  virtual Result<SymmetricBlockMatrix> hold() const = 0;
  /// What no field joins, and which of it something holds.
  virtual const std::vector<TissuePiece>& pieces() const = 0;
  /// Forces on all nodes of the cloud by a hold that has moved so (3 N) [N].
  virtual std::vector<double> held_loads(
      const std::function<Vec3(const Vec3&)>& displacement) const = 0;
};

/// Turns numbers of the cloud in point_nodes and cell_nodes into indices, and lists `nodes`.
void number_nodes(std::size_t node_count, ElasticRegion& region);

/// Square roots of what the points add to the stiffness where `factors` [f, 1 or more] aren't 1:
/// Delta K = B^T B over the nodes that it touches.
struct AddedStiffness {
  std::vector<int> nodes;  ///< indices into the region's, ascending                            (m)
  MatrixX roots;           ///< B [sqrt(N/m)]                                         (rows x 3m)
};
AddedStiffness added_stiffness(const ElasticRegion& region, std::span<const double> factors);

/// Forces on the region's nodes under which the body takes the strains `eigenstrains` (e, one
/// number a point), its points being `factors` times as stiff [N].                              (3
/// n)
VectorX eigenstrain_load(const ElasticRegion& region, std::span<const double> factors,
                         std::span<const double> eigenstrains);

/// Adds Delta K to the body's stiffness, for those who factor it anew.
void add_stiffness(const ElasticRegion& region, std::span<const double> factors,
                   SymmetricBlockMatrix& stiffness);

}  // namespace viscera
