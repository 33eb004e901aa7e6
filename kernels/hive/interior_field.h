// The half-space inside: displacement and stress under a point force on its surface, in elementary
// functions [Boussinesq1885] [Cerruti1882] [Johnson1985] ch. 3. (kernels/contact/half_space.h has
// the surface alone, and loads of some width.)
#pragma once

#include <array>

#include "kernels/base/types.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

class InteriorField {
 public:
  explicit InteriorField(const IsotropicMaterial& material);

  /// Displacement per unit force [m/N]: column f, force along axis f. `offset` from the load, not
  /// zero; `inward` unit. Valid also a little above the surface, off the axis.
  Mat3 displacement(const Vec3& offset, const Vec3& inward) const;
  /// Derivative of displacement by x, y and z [1/N].
  std::array<Mat3, 3> gradient(const Vec3& offset, const Vec3& inward) const;
  /// Traction on a surface with outward unit `normal` per unit force [1/m2].
  Mat3 traction(const Vec3& offset, const Vec3& inward, const Vec3& normal) const;

 private:
  double scale_ = 0.0;  ///< 1 / (4 pi G)
  double kappa_ = 0.0;  ///< 1 - 2 nu
  double lambda_ = 0.0, mu_ = 0.0;
};

}  // namespace viscera
