// Contact between many bodies at a time, where one dense problem would be too great: nonlinear
// block Gauss-Seidel [Jean1999], a block for each two bodies that touch.
#pragma once

#include <span>
#include <vector>

#include "kernels/contact/contact_conditions.h"
#include "kernels/contact/island_unknowns.h"

namespace viscera {

struct SweepFigures {
  int sweeps = 0;  ///< over all blocks
  int blocks = 0;
  bool converged = false;  ///< false: the residual is what was left after the last sweep
  double residual = 0.0;   ///< greatest violation of a condition, as a force over the greatest one;
                           ///< 1 where something wasn't finite, and there are no forces
  double lifted = 0.0;     ///< greatest of the blocks, as ContactSolution::lifted
};

/// What the forces on a body's cells move is kept for each body, so that a block costs what its two
/// bodies' cells do. Bounded, deterministic. Keeps its work arrays between calls.
class ContactSweeps {
 public:
  /// Conditions on (x, w) with w = A x - `wanted`: A is the sum over bodies of what their responses
  /// say along the unknowns, with the softness of each, its diagonal greater by the share `ridge`,
  /// and each block lifted to be positive (rise_to_positive.h).
  /// `responses`: of each body (3 cells) x (3 cells), symmetric. The unknowns of one condition are
  /// between the same bodies. `x` (in: a guess): forces. `tolerance`: residual to reach.
  SweepFigures solve(std::span<const MatrixX* const> responses,
                     std::span<const IslandUnknown> unknowns,
                     std::span<const ContactCondition> conditions, double ridge, double tolerance,
                     const VectorX& wanted, VectorX& x);

 private:
  /// A body, by the cells that some unknown presses.
  struct Body {
    std::vector<int> place_of;  // of its cells among these; -1: none presses it
    std::vector<Eigen::Index> rows;
    MatrixX response;
    VectorX moved;  // by the forces
  };
  struct Block {
    std::vector<IslandUnknown> unknowns;  // cells: places in Body
    std::vector<Eigen::Index> from;       // of which of all unknowns
    std::vector<ContactCondition> conditions;
    MatrixX matrix;
    VectorX added;   // to the diagonal, beyond what the bodies say
    MatrixX lifted;  // besides, where that isn't positive; empty: nothing
    VectorX step;
    VectorX x, before, gaps, residual, wanted;
    double violated = 0.0;
  };

  void part(std::span<const IslandUnknown> unknowns, std::span<const ContactCondition> conditions);
  void take_turns(std::size_t bodies);
  void take_bodies(std::span<const MatrixX* const> responses);
  double assemble(double ridge, Block& block) const;
  void find_gaps(Block& block) const;
  void press(Block& block) const;
  void move(const Block& block);

  std::vector<Block> blocks_;
  std::vector<std::vector<std::size_t>> turns_;  // blocks of one turn share no body
  std::vector<Body> bodies_;
};

}  // namespace viscera
