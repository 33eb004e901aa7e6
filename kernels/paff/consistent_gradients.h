// Symmetric variationally consistent integration, after [Chen2013]: gradients at the volume points,
// corrected so that the quadrature satisfies the divergence theorem for every shape function. There
// the test functions alone are corrected, which makes the stiffness unsymmetric; here the corrected
// gradients serve trial and test functions alike, so linear fields must stay exact too.
#pragma once

#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/block_matrix.h"
#include "kernels/paff/cut_cells.h"
#include "kernels/paff/point_fields.h"
#include "kernels/paff/surface_quadrature.h"

namespace viscera {

/// What it took to make gradients consistent.
struct ConsistencyChange {
  double size = 0.0;  ///< over the gradients', a measure of the quadrature: 0.015 to 0.05
  std::vector<double> multipliers;  ///< of the nodes: what correct_gradients makes it from again
};

/// Replaces `volume_fields.gradients` g by g~ with
///   sum_q w_q (m g~_Iq + phi_I grad m) = sum_b w_b m phi_I n_b     (the integration constraint,
///   over
///                                                                   all surface points b)
///   sum_I g~_Iq p(x_I) = grad p(y_q)                               (the basis p stays exact),
/// m the polynomials one degree lower than the basis; the smallest such change in the norm of the
/// weights W (derived in the source). The quadratic basis needs points of degree 2 in the volume
/// and of degree 4 on the surface. Fails where the sparse factorisation does, and where the
/// constraint can't be met to 1e-11 of its sums, or by a change smaller than the gradients only.
Result<ConsistencyChange> make_gradients_consistent(const ShapeFunctions& shape,
                                                    const VolumeQuadrature& volume,
                                                    const NodeIncidence& volume_incidence,
                                                    const SurfaceQuadrature& surface,
                                                    const PointFields& surface_fields,
                                                    PointFields& volume_fields);

/// The same change at some of the points, whose plain gradients `fields` holds: a point's depends
/// on the multipliers of the nodes that reach it alone.
void correct_gradients(const ShapeFunctions& shape, const VolumeQuadrature& some,
                       const std::vector<double>& multipliers, PointFields& fields);

}  // namespace viscera
