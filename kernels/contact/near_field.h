// The part of contact that is finer than the nodes.
//
// A cloud of spacing h can't carry a load narrower than about h: pressed by a 1 mm tip it answers
// as if the tip were about h wide, more or less so as the tip passes nodes. So each contact load is
// split as Ewald splits a sum [Ewald1921]: the load spread by a Gaussian of standard deviation
// sigma ~ h goes to the precomputed compliance of the whole body, which is accurate at that scale;
// what is left (the sharp load minus the spread one, no net force, felt within some 3 sigma) sees
// the body as a half-space, whose answer is known in closed form [Boussinesq1885] [Johnson1985]
// ch. 3. Measured through the same Gaussian, the spread part of the half-space kernel
// 1 / (pi E* r) is
//   G_sigma(r) = (1 / (pi E*)) (sqrt(pi) / (2 sigma)) exp(-r^2 / (8 sigma^2)) I0(r^2 / (8
//   sigma^2)).
// In Fourier space the rest is (2 / E*) (1 - exp(-sigma^2 q^2)) / q >= 0: both parts are symmetric
// and positive, so their sum is, and nothing is fitted.
#pragma once

#include "kernels/base/types.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

class NearField {
 public:
  /// `sigma` [m]: standard deviation of the spreading Gaussian.
  NearField(const IsotropicMaterial& material, double sigma);

  double sigma() const { return sigma_; }

  /// Mean normal displacement of a disc-like cell of `area` at distance r from a cell of that area
  /// that carries a unit normal force, less the spread part [m/N]. r = 0: the cell itself.
  double normal_compliance(double r, double area) const;
  /// The same for a tangential force, its direction averaged [Cerruti1882].
  double tangential_compliance(double r, double area) const;
  /// Normal displacement of a surface point at distance r from a unit normal force on a cell of
  /// `area`, less what the spread load already gives there [m/N]. For the drawn surface.
  double drawn_normal(double r, double area) const;
  double drawn_tangential(double r, double area) const;
  /// Beyond this distance the near field is below 1e-3 of its value at a sigma, and taken as zero;
  /// it falls smoothly over the last quarter [m].
  double range() const;

  /// Beyond this distance a force of this size [N] moves the drawn surface by less than a
  /// micrometre of near field; at most range() [m].
  double drawn_range(double force) const;
  /// tangential_compliance over normal_compliance.
  double tangential_share() const { return tangential_scale_ / normal_scale_; }
  /// Displacement of a surface point at `offset` [m] from a cell under `force` [N], less what the
  /// spread load already gives there [m].
  Vec3 drawn_displacement(const Vec3& offset, const Vec3& normal, double area,
                          const Vec3& force) const;

 private:
  double cell_kernel(double r, double area) const;   ///< of 1/r, disc to disc [1/m]
  double point_kernel(double r, double area) const;  ///< of 1/r, disc to point [1/m]

  double normal_scale_ = 0.0;  ///< 1 / (pi E*) [1/Pa]
  double tangential_scale_ = 0.0;
  double sigma_ = 0.0;
};

}  // namespace viscera
