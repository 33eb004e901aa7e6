// What makes a contact's matrix positive where it isn't.
#pragma once

#include "kernels/base/types.h"

namespace viscera {

struct Rise {
  MatrixX matrix;      ///< to be added; empty: nothing can be said
  double share = 0.0;  ///< its greatest eigenvalue over that of the matrix, both scaled
};

/// Of a symmetric matrix, scaled to a unit diagonal: lifts its eigenvalues to `least`, no more.
Rise rise_to_positive(const MatrixX& matrix, double least);

}  // namespace viscera
