// A solve of one body whose forces are decided together with those of bodies that it touches
// (contact_island.h). A prepared body has one question; one at finite strain asks again after each
// of its quasi-Newton steps.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/contact/contact_cells.h"

namespace viscera {

/// Forces f on the cells are wanted where these lie at free + response f, in the body's frame.
struct SharedQuestion {
  VectorX free;                       ///< [m]                                        (3 cells)
  const MatrixX* response = nullptr;  ///< [m/N]; until the next question  (3 cells) x (3 cells)
  std::vector<ContactCell> cells;     ///< with what is wanted of them in this question
  /// The body has come to where it stays: the answer says forces alone.
  bool last = false;
};

class SharedSolve {
 public:
  virtual ~SharedSolve() = default;

  /// The last one stands until end().
  virtual const SharedQuestion& question() const = 0;
  /// Of one that isn't the last. Null: there are no such forces, and what touches the body lets go
  /// for this step.
  virtual void answer(const VectorX* forces) = 0;
  /// Forces that answer the last question [N]; null as there. `backing`: what the bodies behind the
  /// last cells yield, as TissueContact::solve has it, for whoever asks what they hold.
  virtual void end(const VectorX* forces, const MatrixX& backing) = 0;
};

}  // namespace viscera
