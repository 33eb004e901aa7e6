// A smooth displacement field on the unit cube with the body force and tractions that hold it.
#pragma once

#include <array>

#include "kernels/paff/elasticity.h"

namespace viscera {

/// u(x) = sum_i a_i sin(k_i . x' + p_i) over four waves, x' = x + (1/2, 1/2, 1/2): x' runs over
/// [0, 1]^3 on the cube about the origin. Each wave has a part across k_i and a part along it that
/// shrinks with 1 - 2 nu, so that the pressure stays bounded near incompressibility. The cube is
/// held at its bottom and loaded on the other faces.
class SmoothSolution {
 public:
  explicit SmoothSolution(const IsotropicMaterial& material);

  Vec3 displacement(const Vec3& x) const;  ///< [m]
  Mat3 gradient(const Vec3& x) const;      ///< (a, b) = d u_a / d x_b
  Mat3 stress(const Vec3& x) const;        ///< [Pa]
  Vec3 body_force(const Vec3& x) const;    ///< -div sigma [N/m3]

  /// Held displacement, tractions and body force; the object may be dropped.
  StaticLoads loads() const;

  /// The bottom of the cube.
  static bool is_fixed(const Vec3& x) { return x.z() < -0.5 + 1e-9; }

 private:
  IsotropicMaterial material_;
  std::array<Vec3, 4> amplitude_;
};

/// Relative L2 error of the field of `unknowns` (3 N) over the nodes of its cloud: the field's own
/// values sum_J phi_J alpha_J, or the unknowns themselves where a formulation interpolates.
double smooth_solution_error(const SmoothSolution& exact, const Formulation& formulation,
                             const PointCloud& cloud, const std::vector<double>& unknowns);

}  // namespace viscera
