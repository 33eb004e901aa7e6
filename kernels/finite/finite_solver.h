// One implicit step of a body at finite strain: the energy is the truth, the factor of the body at
// rest, turned with its parts, only preconditions.
//
// A step of dt minimises, under the rows Phi u = d of what holds the tissue,
//   E(u) = elastic + time mu / dt |E - E_n|^2 + sum_J m_J / (2 dt^2) |u_J - u~_J|^2,
//   u~ = u_n + dt v_n + dt^2 g,
// by a few quasi-Newton steps: with H the inverse that the warped factor and the last pairs of
// steps make, W = Phi H Phi^T and g the gradient, W lambda = d - Phi u + Phi H g and
// p = H (Phi^T lambda - g).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/finite/finite_body.h"
#include "kernels/finite/warped_factor.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {

struct FiniteOptions {
  double time_step = 1.0 / 60.0;  ///< [s]
  double density = 1060.0;        ///< [kg/m3]
  double viscous_time = 0.02;     ///< viscosity over shear modulus [s]
  /// False: each step goes to equilibrium, without mass and viscosity.
  bool dynamic = true;
  int iterations = 2;           ///< quasi-Newton steps a step; more after a release
  int iterations_released = 6;  ///< ... for the first steps after
  /// A step ends where a further iteration would gain less than this share of the energy.
  double decrement = 2e-6;
  Vec3 gravity = Vec3::Zero();  ///< [m/s2], as far as the rest shape doesn't know it
};

/// What lasts from step to step.
struct FiniteState {
  std::vector<double> displacements;  ///< [m]                                              (3 N)
  std::vector<double> velocities;     ///< [m/s]                                            (3 N)
  Strains strains;                    ///<                                                  (6 Q)
  NodalRotations rotations;           ///<                                                  (9 N)
  std::int32_t steps_since_warp = 0;
  std::int32_t steps_released = 0;  ///< more iterations for so many steps
  std::int32_t held = 0;            ///< points held in the last step

  static constexpr auto fields() {
    return std::tuple(
        field("displacements", &FiniteState::displacements),
        field("velocities", &FiniteState::velocities), field("strains", &FiniteState::strains),
        field("rotations", &FiniteState::rotations),
        field("steps_since_warp", &FiniteState::steps_since_warp),
        field("steps_released", &FiniteState::steps_released), field("held", &FiniteState::held));
  }
};

/// Points of the tissue that something holds, by the fields there: u(p) = sum_J phi_J(p) u_J.
struct HeldRows {
  std::vector<std::size_t> begin{0};  ///<                                              (points + 1)
  std::vector<int> nodes;             ///<                                                 (entries)
  std::vector<double> values;         ///<                                                 (entries)

  std::size_t points() const { return begin.size() - 1; }
  void add(std::span<const int> point_nodes, std::span<const double> point_values);
};

/// Rows with what the factor makes of them; as long as the same is held they stay.
struct Grip {
  HeldRows rows;
  MatrixX columns;  ///< P^-1 Phi^T [m/N]                                          (3 N x 3 points)
};

/// Where a grip wants its points.
struct GripTarget {
  const Grip* grip = nullptr;
  std::vector<Vec3> displacements;  ///< [m]                                              (points)
};

/// How a step went.
struct FiniteStep {
  int iterations = 0;
  double energy = 0.0;     ///< elastic, viscous and of inertia [J]
  double residual = 0.0;   ///< of the last iteration: what a further one would gain over the energy
  bool converged = false;  ///< residual within FiniteOptions::decrement
  bool lost = false;       ///< the last good state was kept: no step was found
  int evaluations = 0;     ///< of the energy
  std::vector<Vec3> forces;  ///< on the tissue at the held points, grip after grip [N]
};

class FiniteSolver {
 public:
  /// Factors what preconditions: the body at rest with viscosity and mass. `masses`: of the nodes
  /// over the density, the integrals of their fields [m3] (N). Fails as factoring does: without
  /// dynamics, for a body that nothing holds.
  static Result<FiniteSolver> prepare(std::shared_ptr<const FiniteBody> body,
                                      std::span<const Vec3> positions,
                                      std::span<const double> volumes,
                                      const FiniteOptions& options);

  /// The same with other options of the search: iterations, decrement.
  FiniteSolver with(int iterations, double decrement) const;

  FiniteState at_rest() const;
  Grip grip(HeldRows rows) const;

  /// One step. On failure the state is as it was, at rest.
  FiniteStep step(std::span<const GripTarget> targets, FiniteState& state) const;

  const FiniteBody& body() const { return *body_; }
  const FiniteOptions& options() const { return options_; }
  std::size_t memory_bytes() const { return body_->memory_bytes() + factor_->factor_bytes(); }

 private:
  class Descent;
  FiniteSolver() = default;

  std::shared_ptr<const FiniteBody> body_;
  std::shared_ptr<const StiffnessFactor> factor_;
  std::vector<double> masses_;  // [kg]                                                          (N)
  FiniteOptions options_;
};

}  // namespace viscera
