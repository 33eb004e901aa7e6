// A hollow sphere under inner pressure, whose answer is Lame's.
#pragma once

#include "engine/verification/bodies.h"

namespace viscera {

/// About the origin, under a tenth of Young's modulus from inside: u = (A + B / r^3) x with
/// A = p a^3 (1 - 2 nu) / ((b^3 - a^3) E), B = p a^3 b^3 / (4 G (b^3 - a^3)), and the tractions of
/// its stress, which hold it on any body: also between two polyhedra, so that no error of the
/// surface mixes in.
class PressurisedSphere {
 public:
  PressurisedSphere(const IsotropicMaterial& material, double inner, double outer);
  Vec3 operator()(const Vec3& x) const { return (uniform_ + radial_ / std::pow(x.norm(), 3)) * x; }
  /// Held with this displacement where the body is held, elsewhere its tractions.
  StaticLoads loads() const;

 private:
  IsotropicMaterial material_;
  double uniform_, radial_;
};

/// Triangles about `edge` wide on both faces.
TriangleSurface hollow_sphere(double inner, double outer, double edge);

}  // namespace viscera
