// Whether a compliance gives back no more energy than was put in, by all its eigenvalues: for
// checks of small bodies. Preparation asks smallest_compliance_eigenvalue() (kernels/paff).
#pragma once

#include "kernels/paff/elasticity.h"

namespace viscera {

/// Least eigenvalue of the symmetric part of the touchable square over its Frobenius norm, where it
/// lies below -2^-23, what storing in single precision explains; else 0: f.C f >= 0 for all forces.
/// Costs a Cholesky factorisation of order 3 touchable, and the eigenvalues where that fails. NaN
/// where an entry isn't finite.
double negative_compliance(const SurfaceCompliance& compliance);

}  // namespace viscera
