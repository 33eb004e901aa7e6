// Dilatation averaged over cells (B-bar [Hughes1980]), so that nearly incompressible bodies don't
// lock: pointwise, there are more constraints of constant volume than nodal unknowns.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/paff/cut_cells.h"
#include "kernels/paff/local_spacing.h"
#include "kernels/paff/point_fields.h"
#include "kernels/paff/surface_quadrature.h"
#include "kernels/paff/tissue_paths.h"

namespace viscera {

/// The dilatation projected on the polynomials 1, x, y, z of each cell, so that the dilatation of a
/// quadratic field is left as it is. (Constants alone leave linear pressures sawteeth, to which
/// fields as smooth as these answer: the error of a cube grew tenfold.) With psi_k orthonormal over
/// the quadrature points of a cell, the projected dilatation of sum_J phi_J u_J is
/// sum_k psi_k(y) sum_J G_kJ . u_J, G_kJ = sum_q w psi_k(y_q) g~_Jq. One row for each psi of each
/// cell.
struct MeanDilatation {
  PointFields rows;  ///< nodes, ascending in each row, and as gradients G [sqrt(m)]
  /// T_kI = sum_b w psi_k(x_b) phi_I n over the fixed points b of the cell [sqrt(m)] (entries)
  std::vector<Vec3> fluxes;

  /// For each fixed point its rows and the values of psi there: `terms` of them a point.
  std::size_t terms = 0;               ///< polynomials a cell; 0: nothing is averaged
  std::vector<std::size_t> first_row;  ///< (fixed points)
  std::vector<double> psi;             ///< [m^-1.5]                          (fixed points x terms)

  /// The same for each point of the volume: its cell's rows follow terms * cell.
  std::vector<int> cell;           ///<                                          (volume points)
  std::vector<double> volume_psi;  ///< [m^-1.5]                         (volume points x terms)
};

/// The fixed points: indices into `surface`, their fields and Nitsche's penalty on the normal
/// displacement over lambda [1/m].
struct HeldSurface {
  const SurfaceQuadrature& surface;
  std::span<const std::size_t> points;
  const PointFields& fields;
  std::span<const double> penalty;
};

/// Cells follow the spacing, some two spacings wide. Cells of walls too thin for a linear
/// polynomial across, or where it would outgrow Nitsche's penalty, have fewer: sum_r (G.u)^2 - 2
/// (G.u) (T.u)
/// + sum_b w penalty (n.u)^2 >= 0 for all u, so averaging leaves the stiffness positive definite.
/// With `paths`, a cell is what its seed sees, over gently concave surfaces too: none reaches
/// across air.
MeanDilatation mean_dilatation(const LocalSpacing& spacing, std::size_t node_count,
                               const VolumeQuadrature& volume, const PointFields& volume_fields,
                               const HeldSurface& held, const TissuePaths* paths = nullptr);

}  // namespace viscera
