// The surface of an elastic half-space under forces on its surface: the closed forms of Boussinesq
// and Cerruti [Boussinesq1885] [Cerruti1882] [Johnson1985] ch. 3, for points, discs and Gaussians.
//
// A force at the origin moves the surface point at r (n outward, I_t the identity in the surface)
// by
//   (1 / (2 pi G r)) [ (1 - nu) n n^T + (1 - nu) I_t + nu r^ r^^T ]
//   + ((1 - 2 nu) / (4 pi G r)) [ r^ n^T - n r^^T ].
// Its Fourier transform over the surface is (1 / (G q)) [ (1 - nu) n n^T + I_t - nu q^ q^^T
// - i (1/2 - nu) (q^ n^T - n q^^T) ], Hermitian, with the eigenvalues 1/2, 1 and 3/2 - 2 nu over
// G q: positive for every Poisson's ratio to 1/2. Whatever spreads the force or averages the
// displacement multiplies it by a function D(q), and the three parts that turn with the angle as
// cos 0, cos 1 and cos 2 follow from K_m(r) = int_0^inf D(q) J_m(q r) dq. For the point K_m = 1/r.
#pragma once

#include "kernels/base/types.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// K_0, K_1, K_2 above [1/m].
struct RadialKernels {
  double monopole = 0.0, dipole = 0.0, quadrupole = 0.0;

  RadialKernels operator-(const RadialKernels& other) const {
    return {monopole - other.monopole, dipole - other.dipole, quadrupole - other.quadrupole};
  }
  RadialKernels operator*(double factor) const {
    return {factor * monopole, factor * dipole, factor * quadrupole};
  }
};

/// A uniform load on a disc of radius c, displacement at a point: D = 2 J1(q c) / (q c). [Love1929]
RadialKernels disc_to_point(double r, double c);
/// The same averaged over another disc of that radius: D = (2 J1(q c) / (q c))^2. To 1e-4 of 1/c.
RadialKernels disc_to_disc(double r, double c);
/// A load spread by a Gaussian of standard deviation s: D = exp(-s^2 q^2 / 2). To 3e-7 of 1/s.
RadialKernels gaussian_to_point(double r, double s);

/// Half-space of one material.
class HalfSpace {
 public:
  explicit HalfSpace(const IsotropicMaterial& material);

  /// Displacement per unit force [m/N], 3 x 3, at `offset` [m] from the load on a surface with the
  /// outward unit `normal`; only the part of `offset` along the surface has a direction.
  /// Reciprocal: response(-offset) is the transpose.
  Mat3 response(const RadialKernels& kernels, const Vec3& offset, const Vec3& normal) const;
  /// response(...) * force, without the matrix.
  Vec3 displacement(const RadialKernels& kernels, const Vec3& offset, const Vec3& normal,
                    const Vec3& force) const;

  /// Greatest displacement over force for a tail (K_0, K_2) = (1, -3) [1/Pa]; what a Gaussian
  /// leaves far off.
  double tail_scale() const;

 private:
  /// The parts of the response at one place.
  struct Parts {
    Vec3 along;                ///< unit, from the load along the surface; zero at the load
    double mean, turn, mixed;  ///< that turn with the angle as cos 0, cos 2 and cos 1 [m/N]
  };
  Parts parts(const RadialKernels& kernels, const Vec3& offset, const Vec3& normal) const;

  double normal_ = 0.0, mean_tangential_ = 0.0, turning_ = 0.0, coupling_ = 0.0;  // [1/Pa]
};

}  // namespace viscera
