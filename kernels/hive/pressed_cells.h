// The complementarity problem of one tick, in memory of constant size.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

/// Cells pressed by a rigid tool on a dense compliance, no cell pulling: x >= 0, A x >= depth,
/// complementary. As UnilateralSolver (kernels/contact/unilateral.h), for a matrix that stays while
/// depths change: the factor of the touching cells is kept until another set touches, and nothing
/// is allocated.
class PressedCells {
 public:
  explicit PressedCells(int most_cells);

  int most() const { return most_; }
  int size() const { return size_; }

  /// The matrix to be filled: lower triangle, (cells x cells) [m/N]. Then call check().
  Eigen::Ref<MatrixX> begin(int cells) noexcept;
  /// Mirrors it and makes sure that it is positive, raising the diagonal where it isn't: cells
  /// around an edge. False: not finite, or far from positive.
  bool check() noexcept;

  /// What one tick leaves to the next: where the search for the touching cells begins, and for
  /// which of them the factor is at hand. The matrix is its owner's to fill again.
  struct State {
    std::vector<char> active;    ///< 0 or 1  (cells)
    std::vector<char> factored;  ///< empty: no factor  (cells)
    static constexpr auto fields() {
      return std::tuple(field("active", &State::active), field("factored", &State::factored));
    }
  };
  State state() const;
  /// After begin() and check(), where a factor is at hand. Forces are those of the next solve().
  void restore(const State& state) noexcept;
  bool fits(const State& state) const noexcept;

  struct Figures {
    bool converged = false;
    int factorisations = 0, touching = 0;
    double energy = 0.0;  ///< x A x / 2 [J]
  };
  /// Forces [N] for these depths [m]; zero where it doesn't converge.
  Figures solve(std::span<const double> depths) noexcept;

  std::span<const double> forces() const noexcept {
    return {forces_.data(), static_cast<std::size_t>(size_)};
  }
  Eigen::Ref<const MatrixX> matrix() const noexcept { return matrix_.topLeftCorner(size_, size_); }
  double lifted() const noexcept { return lifted_; }  ///< over the mean of the diagonal
  double smallest_pivot() const noexcept { return smallest_pivot_; }

 private:
  bool factor() noexcept;

  int most_ = 0, size_ = 0;
  MatrixX matrix_, part_;
  VectorX forces_, gaps_, small_;
  std::vector<char> active_, factored_;
  std::vector<int> indices_;
  int count_ = 0;
  bool factor_known_ = false;
  double lifted_ = 0.0, smallest_pivot_ = 0.0;
};
static_assert(fields_cover<PressedCells::State>());

}  // namespace viscera
