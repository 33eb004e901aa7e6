// A step of a body at finite strain that stops wherever the forces on its cells must be known, so
// that several bodies that touch each other can be asked together.
#pragma once

#include <memory>
#include <optional>

#include "kernels/base/types.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {

class TouchedStep {
 public:
  /// As FiniteSolver::step; all of it outlives the step. `touch` isn't asked for forces. `shared`:
  /// they are decided with those of other bodies, which may go on when this step has come to its
  /// end: it always asks a last question, and makes the way that the answer in the end says.
  TouchedStep(const FiniteSolver& solver, FiniteTouch& touch, FiniteState& state,
              const BodyLoad& load, std::optional<StepSoFar>* so_far = nullptr,
              bool shared = false);
  TouchedStep(TouchedStep&&) noexcept;
  TouchedStep& operator=(TouchedStep&&) noexcept;
  ~TouchedStep();

  /// What must be known to go on, of a body with cells; null: the step can end.
  const TouchQuestion* question() const;
  /// Forces that answer the question; nothing: there are none, and it is a step without them.
  void answer(std::optional<VectorX> forces);

  /// Once there is no question: takes the state to where the step ended, at rest with these forces
  /// on its cells; null: with those of its last answer.
  FiniteStep end(const VectorX* forces = nullptr);

 private:
  class Descent;
  std::unique_ptr<Descent> descent_;
};

}  // namespace viscera
