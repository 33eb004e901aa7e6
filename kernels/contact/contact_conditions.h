// What forces of contact must satisfy together with the gaps that they leave.
#pragma once

#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// What one or three unknowns of a contact problem must satisfy with w = A x - b.
struct ContactCondition {
  enum class Kind {
    kBilateral,   ///< w = 0                                                  (1 unknown)
    kUnilateral,  ///< x >= 0, w >= 0, x w = 0                                (1)
    kFriction,    ///< the first as above; the other two, tangential: |x_t| <= mu x_n, and where
                  ///< w_t is not 0 (the cell slips) x_t = -mu x_n w_t / |w_t|  (3)
  };
  Kind kind = Kind::kUnilateral;
  double friction = 0.0;  ///< mu of kFriction

  int unknowns() const { return kind == Kind::kFriction ? 3 : 1; }
};

/// The point of the disc of this radius that is nearest to y.
Vec2 onto_disc(const Vec2& y, double radius);

/// Per unknown: displacement to force, 1 / (mean diagonal of its condition) [N/m].
VectorX forces_of_gaps(const VectorX& diagonal, std::span<const ContactCondition> conditions);

/// residual = x - (projection of x - step * gap on what the conditions allow): zero exactly where
/// they hold. `step` as forces_of_gaps says.
void contact_residual(std::span<const ContactCondition> conditions, const VectorX& step,
                      const VectorX& x, const VectorX& gaps, VectorX& residual);

/// One Gauss-Seidel pass, condition after condition; keeps gaps = A x - b up to date.
void sweep_contact(const MatrixX& matrix, std::span<const ContactCondition> conditions, VectorX& x,
                   VectorX& gaps);

/// Forces whose signs and cones are broken by no more than a residual come back into them.
void into_cones(std::span<const ContactCondition> conditions, VectorX& x);

}  // namespace viscera
