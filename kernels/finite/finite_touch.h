// What touches a body at finite strain, as a step of the body asks for it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "kernels/base/types.h"
#include "kernels/finite/finite_body.h"
#include "kernels/finite/finite_state.h"

namespace viscera {

/// What a step asks of what touches its body: forces f on the cells that meet the conditions where
/// the cells lie at free + (FiniteTouch::response() + more + what is finer) f.
struct TouchQuestion {
  VectorX free;  ///< [m]                                                            (3 cells)
  MatrixX more;  ///< [m/N]; may be empty                                (3 cells) x (3 cells)
  /// Of the way from where the cells were as the step began to what is wanted only this share is
  /// asked for.
  double share = 1.0;
  /// The body has come to where it stays; the answer says by which forces.
  bool last = false;
};

/// Places ("cells") of the body with a force each, which conditions decide: a cell's displacement
/// is what the nodes have there, Phi u, and what is finer than nodes.
class FiniteTouch {
 public:
  virtual ~FiniteTouch() = default;

  virtual std::size_t cells() const = 0;
  /// How many of them are held, whatever pulls at them.
  virtual std::int32_t held() const = 0;
  /// Nodes with one number are turned together, so that Phi R = R Phi; -1: by themselves.    (N)
  virtual std::span<const int> groups() const = 0;
  /// What has become of the tissue, to be asked once a step.
  virtual const ChangedTissue& changed() const {
    static const ChangedTissue nothing;
    return nothing;
  }
  /// What the tissue remembers of before the step, likewise.
  virtual const Overstress& overstress() const {
    static const Overstress nothing;
    return nothing;
  }
  /// From now on the factor is turned so.
  virtual void turn(const NodalRotations& rotations) = 0;
  /// Phi R P^-1 R^T Phi^T [m/N].                                          (3 cells) x (3 cells)
  virtual const MatrixX& response() const = 0;
  virtual VectorX displaced(const VectorX& u) const = 0;  ///< Phi u [m]                (3 cells)
  /// H Phi^T f for forces on the cells, H = R P^-1 R^T.                                   (3 N)
  virtual VectorX answer_to(const VectorX& forces) const = 0;
  /// Adds Phi^T f to nodal loads [N].                                                     (3 N)
  virtual void add_loads(const VectorX& forces, VectorX& loads) const = 0;
  /// Forces on these cells whose loads are all that the state has (FiniteState::loads), so that
  /// nothing need be solved for to know their answer; none: they aren't known.
  virtual std::optional<VectorX> standing() const { return std::nullopt; }
  /// A step begins where the nodes have the cells at `displaced`, what is finer not among it. How
  /// far what is wanted of a cell is from where it is, at most [m].
  virtual double begin(const VectorX& displaced) = 0;
  /// The forces [N]; nothing: there are none.                                       (3 cells)
  virtual std::optional<VectorX> solve(const TouchQuestion& question) = 0;
};

}  // namespace viscera
