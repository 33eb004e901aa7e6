// Whether a compliance may be touched: it must not give back more energy than was put in.
#pragma once

#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Least eigenvalue of the symmetric part of the touchable square over its Frobenius norm, where it
/// lies below -2^-23, what storing in single precision explains; else 0: f.C f >= 0 for all forces.
/// Costs a Cholesky factorisation of order 3 touchable, and the eigenvalues where that fails. NaN
/// where an entry isn't finite.
double negative_compliance(const SurfaceCompliance& compliance);

/// Refuses a compliance that isn't positive, with the reason and what to change.
Result<void> check_passive(const SurfaceCompliance& compliance);

}  // namespace viscera
