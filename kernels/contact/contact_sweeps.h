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
  bool converged = false;  ///< false: the residual is what was left after the last sweep; without
                           ///< forces where something wasn't finite
  double residual = 0.0;   ///< greatest violation of a condition, as a force over the greatest one
};

/// What the forces on a body's cells move is kept for each body, so that a block costs what its two
/// bodies' cells do. Bounded, deterministic. Keeps its work arrays between calls.
class ContactSweeps {
 public:
  /// Conditions on (x, w) with w = A x - `wanted`: A is the sum over bodies of what their responses
  /// say along the unknowns, with the softness of each, its diagonal greater by the share `ridge`.
  /// `responses`: of each body (3 cells) x (3 cells), symmetric. The unknowns of one condition are
  /// between the same bodies. `x` (in: a guess): forces.
  SweepFigures solve(std::span<const MatrixX* const> responses,
                     std::span<const IslandUnknown> unknowns,
                     std::span<const ContactCondition> conditions, double ridge,
                     const VectorX& wanted, VectorX& x);

 private:
  struct Block {
    std::vector<Eigen::Index> unknowns;
    std::vector<ContactCondition> conditions;
    MatrixX matrix;
    VectorX added;  // to the diagonal, beyond what the bodies say
    VectorX step;
    VectorX x, before, gaps, residual;
  };

  void part(std::span<const IslandUnknown> unknowns, std::span<const ContactCondition> conditions);
  void assemble(std::span<const MatrixX* const> responses, std::span<const IslandUnknown> unknowns,
                double ridge, Block& block) const;
  void find_gaps(std::span<const IslandUnknown> unknowns, const VectorX& wanted, Block& block);
  void press(Block& block, double violated) const;
  void move(std::span<const MatrixX* const> responses, std::span<const IslandUnknown> unknowns,
            const Block& block);

  std::vector<Block> blocks_;
  std::vector<VectorX> moved_;  // of each body's cells, by the forces
};

}  // namespace viscera
