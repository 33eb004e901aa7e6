// What is finer than the nodes where the modulus changes with depth or along the surface.
//
// A load that varies along the surface as cos(q x) strains tissue about 1/q deep. In a body whose
// modulus is r(z) times that of its material it meets
//   ln M(q) = integral of g(q z) ln r(z) q dz,
// g the share of depths in the energy of the uniform half-space, from its closed stresses. That is
// exact to first order in ln r, the same from either side (r or 1/r), and lies between the bounds
// that fixed strains and fixed stresses give; punches on layers are treated so [Gao1992]. M takes
// the place of 1 in the transform of the near field (near_field.h): scales of sigma, sigma/2, ...
// are bands of wave numbers, each with its own M.
#pragma once

#include <array>
#include <functional>
#include <span>

#include "kernels/contact/near_field.h"

namespace viscera {

struct TouchableSurface;

/// M of loads as narrow as sigma, sigma / 2, sigma / 4, ...: pressed, and pulled aside.
struct NearModulus {
  static constexpr std::size_t kBands = 5;
  std::array<double, kBands> pressed, pulled;
  std::array<double, kBands> pressed_root, pulled_root;  ///< 1 / sqrt of these
};

/// Bands whose modulus differs by a smaller share, as rounding leaves it, are one.
inline constexpr double kSameModulus = 1e-12;

/// Fills the surface's `modulus`. `relative_modulus` is asked below each place over cubes, as
/// ElasticProblem has it; `spread` is sigma over the spacing of nodes.
void note_modulus(TouchableSurface& surface, const IsotropicMaterial& material, double spread,
                  const std::function<double(const Vec3& x, double edge)>& relative_modulus);

/// At a point of the surface: by a bell over the places about it that face its way. Allocates
/// nothing. The surface has a `modulus`.
NearModulus near_modulus_at(const TouchableSurface& surface, const Vec3& position,
                            const Vec3& normal, double spread, double sigma);

/// Response between two cells [m/N], as NearField::cell_response with the root of each one's M.
Mat3 near_response(const IsotropicMaterial& material, double sigma, const Vec3& offset,
                   const Vec3& normal, double area, const NearModulus& one,
                   const NearModulus& other);

/// Modulus of the uniform half-space that answers a disc of this radius [m] with as much near
/// field.
double effective_modulus(const IsotropicMaterial& material, double sigma, double radius,
                         const NearModulus& modulus);

}  // namespace viscera
