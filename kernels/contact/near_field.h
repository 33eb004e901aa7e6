// The part of contact that is finer than the nodes.
//
// A cloud of spacing h can't carry a load narrower than about h: pressed by a 1 mm tip it answers
// as if the tip were about h wide, more or less so as the tip passes nodes. So each contact load is
// split as Ewald splits a sum [Ewald1921]: the load spread by a Gaussian of standard deviation
// sigma ~ h goes to the precomputed compliance of the whole body, which is accurate at that scale;
// what is left (the sharp load minus the spread one, no net force, felt within some 3 sigma) sees
// the body as a half-space, whose answer is known in closed form (half_space.h). Measured through
// the same Gaussian, the spread part of the half-space is its response to a Gaussian of variance
// 2 sigma^2. In Fourier space the rest is (1 - exp(-sigma^2 q^2)) times the half-space's transform,
// which is positive: both parts are symmetric and positive, so their sum is, and nothing is fitted.
#pragma once

#include "kernels/base/types.h"
#include "kernels/contact/half_space.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

class NearField {
 public:
  /// `sigma` [m]: standard deviation of the spreading Gaussian.
  NearField(const IsotropicMaterial& material, double sigma);

  double sigma() const { return sigma_; }

  /// The place of the surface (surface_places.h) that takes most of the load; -1: it wasn't told.
  int place() const { return place_; }
  void set_place(int place) { place_ = place; }

  /// Mean displacement of a disc-like cell of `area` at `offset` from a cell of that area, per unit
  /// force on the latter, less the spread part [m/N]; 3 x 3. `normal` is the outward unit normal of
  /// the surface about both. Reciprocal: cell_response(-offset) is the transpose. Offset 0: the
  /// cell itself.
  Mat3 cell_response(const Vec3& offset, const Vec3& normal, double area) const;
  /// Its kernels at that distance [m]; zero beyond range().
  RadialKernels cell_kernels(double r, double area) const;
  /// Beyond this distance the near field is below 2e-3 of its value at a sigma, and taken as zero;
  /// it falls smoothly over the last quarter [m].
  double range() const;

  /// Beyond this distance a force of this size [N] moves the drawn surface by less than a
  /// micrometre of near field; at most range() [m].
  double drawn_range(double force) const;
  /// Displacement of a surface point at `offset` [m] from a cell under `force` [N], less what the
  /// spread load already gives there [m].
  Vec3 drawn_displacement(const Vec3& offset, const Vec3& normal, double area,
                          const Vec3& force) const;

 private:
  RadialKernels point_kernels(double r, double area) const;  ///< disc to point

  HalfSpace half_space_;
  double sigma_ = 0.0;
  int place_ = -1;
};

}  // namespace viscera
