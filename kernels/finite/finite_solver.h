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
#include <optional>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/finite/finite_body.h"
#include "kernels/finite/finite_state.h"
#include "kernels/finite/grip_touch.h"
#include "kernels/finite/loose_pieces.h"
#include "kernels/finite/warped_factor.h"
#include "kernels/paff/compact_factor.h"
#include "kernels/paff/stiffness_factor.h"
#include "kernels/paff/two_levels.h"

namespace viscera {

struct FiniteOptions {
  double time_step = 1.0 / 60.0;           ///< [s]
  double density = 1060.0;                 ///< [kg/m3]
  double viscous_time = 0.02;              ///< viscosity over shear modulus [s]
  std::vector<RelaxationTerm> relaxation;  ///< beside the long-term modulus
  /// False: each step goes to equilibrium, without mass and viscosity.
  bool dynamic = true;
  /// Nothing holds it: it may go farther than tissue stretches. Needs `dynamic`.
  bool free = false;
  int iterations = 2;           ///< quasi-Newton steps a step; more after a release, and while it
                                ///< is still far from rest (kUnsettled)
  int iterations_released = 6;  ///< ... for the first steps after
  /// A step ends where a further iteration would gain less than this share of the energy.
  double decrement = 2e-6;
  Vec3 gravity = Vec3::Zero();  ///< [m/s2], as far as the rest shape doesn't know it
};

/// What mass adds to the stiffness of a volume within a step [N/m3].
inline double inertia_over_step(const FiniteOptions& options) {
  return options.density / (options.time_step * options.time_step);
}

/// What acts on a body in a step besides what touches it.
struct BodyLoad {
  BodyLoad() = default;
  template <class Derived>
  BodyLoad(const Eigen::MatrixBase<Derived>& of_weight) : acceleration(of_weight) {}

  Vec3 acceleration = Vec3::Zero();  ///< of its weight besides that of the options [m/s2]
  VectorX forces;       ///< on its nodes, as of holds that have moved; empty: none [N]    (3 N)
  double energy = 0.0;  ///< of what makes these where nothing has moved [J]
};

/// How a step went.
struct FiniteStep {
  int iterations = 0;
  double energy = 0.0;     ///< elastic, viscous and of inertia [J]
  double residual = 0.0;   ///< of the last iteration: what a further one would gain over the energy
  bool converged = false;  ///< residual within FiniteOptions::decrement
  bool lost = false;       ///< the last good state was kept: no step was found
  bool answered = true;    ///< false: the conditions had none; it is a step without them
  int evaluations = 0;     ///< of the energy
  std::vector<Vec3> forces;  ///< on the tissue at the cells [N]
};

/// Where a step has come, for the same step with other conditions to go on from.
struct StepSoFar {
  VectorX displacements;  ///<                                                              (3 N)
  VectorX forces;         ///< on the cells, with which they are at rest
  NodalRotations rotations;
  std::shared_ptr<const Strains> strains;  ///< as the step began; null: it has no viscosity
};

class FiniteSolver {
 public:
  /// Factors what preconditions: the body at rest with viscosity and mass. `volumes`: of the nodes,
  /// the integrals of their fields [m3] (N). `piece_of`: as LoosePieces has it. Fails for options
  /// that no step has, and as factoring does: without dynamics, for a body that nothing holds.
  static Result<FiniteSolver> prepare(std::shared_ptr<const FiniteBody> body,
                                      std::span<const Vec3> positions,
                                      std::span<const double> volumes, const FiniteOptions& options,
                                      std::span<const int> piece_of = {});

  /// The same with a factor that an earlier one has prepared.
  static Result<FiniteSolver> prepared(std::shared_ptr<const FiniteBody> body,
                                       std::span<const Vec3> positions,
                                       std::span<const double> volumes,
                                       const FiniteOptions& options,
                                       std::shared_ptr<const StiffnessFactor> factor,
                                       std::span<const int> piece_of = {});

  /// Of a large body (TwoLevels), of the region and hold that it was created from.
  static Result<FiniteSolver> prepare_in_levels(
      std::shared_ptr<const FiniteBody> body, const ElasticRegion& region,
      const SymmetricBlockMatrix& hold, const PointCloud& cloud, std::span<const double> volumes,
      const FiniteOptions& options, std::shared_ptr<const StiffnessFactor> coarse = nullptr);

  /// The same of the body as it was imaged under its weight; what preconditions remains. `body`: of
  /// as many nodes.
  FiniteSolver with(std::shared_ptr<const FiniteBody> body) const;
  /// The same with other options of the search: iterations, decrement.
  FiniteSolver with(int iterations, double decrement) const;

  FiniteState at_rest() const;
  Grip grip(HeldRows rows) const;

  /// One step of a body that anything touches. Where what touches it has no answer, the step is one
  /// without it. `so_far`, unless null, is set to where the step came, or to none; if it holds
  /// where this step has come, from the same state and on the same cells, the step goes on from
  /// there.
  FiniteStep step(FiniteTouch& touch, FiniteState& state, const BodyLoad& load = {},
                  std::optional<StepSoFar>* so_far = nullptr) const;
  /// The same where nothing does.
  FiniteStep step(FiniteState& state, const BodyLoad& load = {}) const;

  /// out = R P^-1 R^T g, P what preconditions a step; columns one after another.  (3 N x columns)
  void precondition(const NodalRotations& rotations, std::span<const double> g,
                    std::span<double> out) const;

  const FiniteBody& body() const { return *body_; }
  const FiniteOptions& options() const { return options_; }
  const LoosePieces& loose() const { return loose_; }
  const std::vector<SteppedTerm>& terms() const { return terms_; }  ///< by which it relaxes
  /// Of the body at rest with what a step adds to it.
  /// Null where `levels` answer.
  const std::shared_ptr<const StiffnessFactor>& factor() const { return factor_; }
  const std::shared_ptr<const TwoLevels>& levels() const { return levels_; }
  std::size_t memory_bytes() const {
    return body_->memory_bytes() + (factor_ ? factor_->factor_bytes() : 0) +
           (compact_ ? compact_->memory_bytes() : 0) + (levels_ ? levels_->memory_bytes() : 0);
  }

 private:
  friend class TouchedStep;
  FiniteSolver() = default;
  /// Sets masses, and with them the pieces.
  void take_nodes(std::span<const Vec3> positions, std::span<const double> volumes,
                  std::span<const int> piece_of);
  /// Rotations for this step, those of a group's nodes the same. A loose piece has one, as it goes
  /// now: of nodes that turn each for itself a shift is a strain, and nothing but mass withstands
  /// one there.
  NodalRotations turned_nodes(std::span<const int> groups, const FiniteState& state) const;
  void turn_held_nodes(std::span<const int> groups, const FiniteState& state,
                       NodalRotations& rotations) const;
  /// Less what would pull on at pieces that have fallen out of view.
  BodyLoad load_in_view(BodyLoad load, const FiniteState& state) const;
  /// Where a step looks first: loose pieces go on as rigid ones would, all else as its nodes do.
  VectorX coming(const FiniteState& state) const;
  /// The state after a step that ended at u.
  void finish(const VectorX& u, bool warped, std::int32_t held, std::int32_t released,
              FiniteState& state) const;

  std::shared_ptr<const FiniteBody> body_;
  std::shared_ptr<const StiffnessFactor> factor_;
  /// The same in sixteen bits; null at equilibrium, where no mass stiffens what a slender body does
  /// most easily: sixteen bits missed a bar's sag there by 5 %.
  std::shared_ptr<const CompactFactor> compact_;
  std::shared_ptr<const TwoLevels> levels_;  // in place of both
  std::vector<double> masses_;  // [kg]                                                         (N)
  LoosePieces loose_;
  FiniteOptions options_;
  std::vector<SteppedTerm> terms_;
};

}  // namespace viscera
