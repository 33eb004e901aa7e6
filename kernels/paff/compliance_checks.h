// Is a compliance one that contact can stand on?
#pragma once

#include <string>

#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Smallest eigenvalue of the symmetric part of C_nn, the touchable square, relative to the
/// largest: by Cholesky factorisation and inverse iteration where it is positive (from above, to a
/// tenth or so), else by the shift that makes it so; 0 where round-off explains what is below
/// zero. Unknowns on which forces have no effect
/// (held nodes of strong forms) are left out. 1 for an empty square,
/// NaN where it isn't finite. Deterministic.
double smallest_compliance_eigenvalue(const SurfaceCompliance& compliance);

/// A tool that moves in a closed path must not gain energy from the tissue: f.C f > 0 for all f.
/// Fails, saying what to change, where `smallest_eigenvalue` (as above) is below zero.
Result<void> expect_positive_compliance(double smallest_eigenvalue);

/// The same for a body of this formulation, but one whose warning() says already that it isn't to
/// be trusted is let pass, with what to tell its user; empty: nothing.
Result<std::string> accept_compliance(const Formulation& formulation, double smallest_eigenvalue);

}  // namespace viscera
