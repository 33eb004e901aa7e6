// The forces between smoke particles, viscosity and crowding, and the counterpart of viscosity from
// the gas at rest around them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/smoke/smoke_bins.h"
#include "kernels/smoke/smoke_particles.h"

namespace viscera {

/// Acceleration in the symmetric pairwise form [Brookshaw1985], [Cleary1999]. Particles stand for
/// parcels of gas of equal mass; with the kernel W(r) = 315 / (64 pi h^3) (1 - r^2/h^2)^3 and the
/// number densities n_i = sum_j W_ij (itself included),
///   a_i = nu lap v - grad p / rho
///       = sum_j 2 / (n_i + n_j) (-W'(r_ij) / r_ij) (2 nu (v_j - v_i) + c^2 (e_i + e_j) (x_i -
///       x_j)),
/// nu = mu / rho + eddy viscosity, c the crowding speed, e = phi - 1 within [0, 4] the excess of
/// particles. Each term is the exact negative, bit for bit, of the one that j takes from i:
/// momentum cancels in pairs.
///
/// Where particles fill only the part phi = n_i V of the neighbourhood, V = (h/2)^3, gas at rest
/// fills the remainder, and the same sum over it, as an integral, is the drag
///   -(1 - phi) 2 nu v int (-W'/r) dV = -(1 - phi) 18 nu / h^2 v.
class SmokeForces {
 public:
  static constexpr int kFewestNeighbours = 4;  ///< with fewer a particle is isolated

  /// Particles must be sorted by `bins`. Isolated particles take no part in pairs, on either side.
  void compute(const SmokeParticles& particles, const SmokeBins& bins,
               const SmokeParameters& parameters);

  std::span<const Vec3f> accelerations() const { return accelerations_; }  ///< [m/s2]        (n)
  std::span<const float> drag() const { return drag_; }  ///< of the gas at rest [1/s]          (n)
  std::uint64_t isolated() const { return isolated_; }
  std::size_t memory_bytes() const;

 private:
  // Positions and velocities by component, padded, for loads of four.
  std::vector<float> x_, y_, z_, vx_, vy_, vz_;
  std::vector<float> excess_;
  std::vector<float> number_density_;  // in units of the kernel's norm; infinite where isolated
  std::vector<Vec3f> accelerations_;
  std::vector<float> drag_;
  std::uint64_t isolated_ = 0;
};

/// mu / rho plus the eddy viscosity [m2/s].
double effective_viscosity(const SmokeParameters& parameters);

}  // namespace viscera
