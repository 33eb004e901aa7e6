// The exchange of momentum between particles: viscosity, with one of two Laplacians, and crowding;
// and how much room is left to the gas around them.
//
// pairwise. With q = 1 - r^2/h^2 within the support and d the vector from one particle to another,
//   lap v_i = sum_j w_ij (v_j - v_i),  w_ij = q^2 (g_i + g_j) / 2,
//   g_i = 6 / (sum_j q^2 r^2 - 2 |sum_j q^2 d|^2 / sum_j q^2).
// It is the symmetric pairwise form [Brookshaw1985], [Cleary1999], with g_i where others divide by
// number densities. A quadratic field's Laplacian needs the trace sum_j w_ij r^2 = 6: with the
// first term of g_i alone that holds, summed over all particles, exactly, on any cloud. But on an
// uneven cloud a linear field isn't at rest: each v_i moves until its own pairs balance, by G sum_j
// w_ij d / sum_j w_ij for a gradient G, and takes 2 |sum q^2 d|^2 / sum q^2 from what resists, as
// in the homogenisation of a network of resistors; hence the second term. Without it the error of a
// decay rate doesn't shrink with spacing; with it, it does, as the square. Each term is the exact
// negative, bit for bit, of what j takes from i: momentum cancels in pairs. For clumps and edges
// g_i is bounded, its denominator kept over half of its first term and over h^2/3 sum q^3, itself
// included, and a pair's mean below 1.2 times the lesser of the two. So
//   sum_j w_ij <= 1.2 * 6 * 5 / h^2,  since sum q^2 = sum q^2 (1 - q) + sum q^3,
// and dt <= h^2 / (36 nu) never makes energy on any cloud. Even ones allow 0.1 h^2 / nu.
//
// paper. Second derivatives of linear moving least squares at the particle, derivatives of the
// moment matrix included: v(x) = p(x) . c(x), A c = f, A = sum W p p^T, f = sum W p v;
//   A c_k = f_k - A_k c,  A c_kk = f_kk - A_kk c - 2 A_k c_k,  lap v = sum_k (c_kk)_0 + 2 (c_k)_k.
// Linear consistency says nothing of second derivatives, and the error doesn't shrink with spacing.
// Nothing bounds its sign either, so what it makes of a velocity in a step is kept between the
// least and the greatest of the neighbours', as the exact equation would keep it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/smoke/bin.h"
#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// The longest stable step for any cloud [s].
inline double longest_viscous_step(double support, double viscosity) {
  return support * support / (36.0 * viscosity);
}

/// Acceleration by neighbours, and the drag rate of the gas that fills the rest, on particles
/// sorted by `bins`. With the number density n_i, phi = fill n_i is the part of the neighbourhood
/// that particles fill; the pairwise sum over gas in the remainder, as an integral, is the rate
/// (1 - phi) int (-2 W'/r) nu dV = (1 - phi) 18 nu / h^2. An excess e = phi - 1 of particles pushes
/// them apart: a_i = c^2/2 sum_j w_ij (e_i + e_j) (x_i - x_j). Isolated particles take no part in
/// pairs, on either side.
class ViscosityPass {
 public:
  void run(std::span<const Float4> positions, std::span<const Float4> velocities,
           const SmokeBins& bins, const ViscosityParameters& parameters);

  std::span<const Float4> accelerations() const { return accelerations_; }  ///< w: drag [1/s] (n)
  std::uint64_t isolated() const { return isolated_; }
  std::size_t memory_bytes() const;

 private:
  void density(const SmokeBins& bins, const ViscosityParameters& parameters);
  void pairs(const SmokeBins& bins, const ViscosityParameters& parameters);

  std::vector<float> x_, y_, z_, vx_, vy_, vz_;  // by component, for loads of eight
  std::vector<float> strength_;                  // g; 0 where isolated
  std::vector<float> excess_;
  std::vector<Float4> accelerations_;
  /// Which particles are near each cell's: found for the density, used for the pairs. For each
  /// chunk of cells, so that many threads write without waiting.
  std::vector<std::vector<std::uint16_t>> notes_;
  std::uint64_t isolated_ = 0;
};

/// Adds viscosity nu lap v by the paper's Laplacian to the accelerations; `strength` is zero where
/// a particle is isolated. Where the moment matrix is singular (particles in a plane) it adds
/// nothing.
void add_paper_viscosity(std::span<const Float4> positions, std::span<const Float4> velocities,
                         std::span<const float> strength, const SmokeBins& bins,
                         const ViscosityParameters& parameters, std::span<Float4> accelerations);

}  // namespace viscera
