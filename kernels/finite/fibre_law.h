// Fibres at finite strain: the standard reinforcing model [Qiu1997] where they are pulled; where
// they are pressed they buckle.
//
// With a the direction at rest and I4 = |F a|^2, s = I4 - 1, their energy's density is
//   E/8 s^2                                   for s >= 0,
//   E/4 b^2 (sqrt(1 + (s/b)^2) - 1)           for s < 0,  b = 2 kBuckling mu / E.
// Fibres that arteries, muscles and capsules are woven of carry tension alone, as models of them
// have it [Holzapfel2000]. But a law without any stiffness under pressure has half a stiffness at
// rest: no linear body would answer like it, and a factor of the body at rest would fit on neither
// side. Fibres within tissue do resist pressure, until they buckle in it where their stress passes
// its shear modulus mu [Rosen1965]. So the stress tends to kBuckling mu: with stiff fibres little
// more than tension alone. The law has three derivatives, and with
// neo-Hooke's it is strongly elliptic whatever E is: along n with the amplitude m,
//   mu |m|^2 |n|^2 + 2 W' |m|^2 (a.n)^2 + ... >= (1 - kBuckling) mu |m|^2 |n|^2 > 0.
// E/8 s^2 alone loses that at s = -2 mu / E. It is finite where tissue is turned inside out.
#pragma once

#include <algorithm>
#include <cmath>

namespace viscera {

/// Stress at which they have buckled, over the shear modulus of what they lie in. Chosen: half of
/// what [Rosen1965] has for straight fibres.
inline constexpr double kBuckling = 0.5;

/// Of one place, by s = I4 - 1.
struct FibreLaw {
  double quarter = 0.0;  ///< E/4 [Pa]
  double bend = 0.0;     ///< 1 / b^2

  static FibreLaw of(double modulus, double shear_modulus) {
    const double inverse = modulus / (2.0 * kBuckling * shear_modulus);
    return {0.25 * modulus, inverse * inverse};
  }
  double root(double s) const {
    const double pressed = std::min(s, 0.0);
    return std::sqrt(1.0 + bend * pressed * pressed);
  }
  double energy(double s) const { return quarter * s * s / (1.0 + root(s)); }
  double slope(double s) const { return quarter * s / root(s); }  ///< its derivative by s
  double curvature(double s) const {                              ///< its second one
    const double r = root(s);
    return quarter / (r * r * r);
  }
};

}  // namespace viscera
