#include "kernels/hive/pressed_cells.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/wide.h"
#include "kernels/contact/dense_cholesky.h"

namespace viscera {
namespace {

constexpr int kPatience = 3;
constexpr double kRoundOff = 1e-11;
/// Least pivot over the greatest diagonal entry, and the most that may be added to the diagonal for
/// its sake.
constexpr double kLeastPivot = 1e-6, kMostLift = 0.2;

/// y = A x, A symmetric and whole, column-major.
VISCERA_WIDE void multiply(const double* a, Eigen::Index stride, Eigen::Index n, const double* x,
                           double* __restrict y) {
  std::fill_n(y, n, 0.0);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double f = x[j];
    if (f == 0.0) continue;
    const double* column = a + j * stride;
#pragma GCC ivdep
    for (Eigen::Index i = 0; i < n; ++i) y[i] += f * column[i];
  }
}

}  // namespace

PressedCells::PressedCells(int most_cells)
    : most_(most_cells),
      matrix_(most_cells, most_cells),
      part_(most_cells, most_cells),
      forces_(VectorX::Zero(most_cells)),
      gaps_(most_cells),
      small_(most_cells),
      active_(static_cast<std::size_t>(most_cells)),
      factored_(static_cast<std::size_t>(most_cells)),
      indices_(static_cast<std::size_t>(most_cells)) {}

Eigen::Ref<MatrixX> PressedCells::begin(int cells) noexcept {
  if (cells != size_) std::fill(active_.begin(), active_.end(), 1);
  size_ = cells;
  factor_known_ = false;
  forces_.head(size_).setZero();
  return matrix_.topLeftCorner(cells, cells);
}

bool PressedCells::check() noexcept {
  const Eigen::Index n = size_;
  auto a = matrix_.topLeftCorner(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = j + 1; i < n; ++i) a(j, i) = a(i, j);
  lifted_ = smallest_pivot_ = 0.0;
  if (n == 0) return true;
  const double greatest = a.diagonal().maxCoeff(), mean = a.diagonal().mean();
  if (!a.allFinite() || !(a.diagonal().minCoeff() > 0.0)) return false;
  for (double lift = 0.0; lift <= kMostLift; lift = std::max(1e-4, 2.0 * lift)) {
    part_.topLeftCorner(n, n) = a;
    part_.topLeftCorner(n, n).diagonal().array() += lift * mean;
    if (!partial_cholesky(part_.data(), most_, n, n, n)) continue;
    const double least = part_.topLeftCorner(n, n).diagonal().minCoeff();
    smallest_pivot_ = least * least / greatest;
    if (smallest_pivot_ < kLeastPivot) continue;
    a.diagonal().array() += lift * mean;
    lifted_ = lift;
    // The factor of all cells is at hand.
    std::fill_n(factored_.begin(), n, 1);
    for (int i = 0; i < size_; ++i) indices_[static_cast<std::size_t>(i)] = i;
    count_ = size_;
    factor_known_ = true;
    return true;
  }
  return false;
}

PressedCells::State PressedCells::state() const {
  State state;
  state.active.assign(active_.begin(), active_.begin() + size_);
  if (factor_known_) state.factored.assign(factored_.begin(), factored_.begin() + size_);
  return state;
}

void PressedCells::restore(const State& state) noexcept {
  size_ = static_cast<int>(state.active.size());
  forces_.setZero();
  factor_known_ = false;
  if (!state.factored.empty()) {
    std::copy(state.factored.begin(), state.factored.end(), active_.begin());
    factor();
  }
  std::copy(state.active.begin(), state.active.end(), active_.begin());
}

bool PressedCells::fits(const State& state) const noexcept {
  const auto binary = [](const std::vector<char>& all) {
    return std::all_of(all.begin(), all.end(), [](char one) { return one == 0 || one == 1; });
  };
  return state.active.size() <= static_cast<std::size_t>(most_) &&
         (state.factored.empty() || state.factored.size() == state.active.size()) &&
         binary(state.active) && binary(state.factored);
}

bool PressedCells::factor() noexcept {
  count_ = 0;
  for (int i = 0; i < size_; ++i)
    if (active_[static_cast<std::size_t>(i)]) indices_[static_cast<std::size_t>(count_++)] = i;
  for (int j = 0; j < count_; ++j)
    for (int i = j; i < count_; ++i)
      part_(i, j) =
          matrix_(indices_[static_cast<std::size_t>(i)], indices_[static_cast<std::size_t>(j)]);
  std::copy_n(active_.begin(), size_, factored_.begin());
  factor_known_ = partial_cholesky(part_.data(), most_, count_, count_, count_);
  return factor_known_;
}

PressedCells::Figures PressedCells::solve(std::span<const double> depths) noexcept {
  Figures figures;
  const int n = size_;
  forces_.head(n).setZero();
  double greatest = 0.0;
  for (const double depth : depths) {
    if (!std::isfinite(depth)) return figures;
    greatest = std::max(greatest, std::abs(depth));
  }
  int fewest = n + 1, patience = kPatience;
  for (int round = 0; round < 100 + 10 * n; ++round) {
    const bool same =
        factor_known_ && std::equal(active_.begin(), active_.begin() + n, factored_.begin());
    if (!same) {
      ++figures.factorisations;
      if (!factor()) return figures;
    }
    for (int i = 0; i < count_; ++i)
      small_[i] = depths[static_cast<std::size_t>(indices_[static_cast<std::size_t>(i)])];
    solve_lower(part_.data(), most_, count_, small_.data());
    solve_lower_transposed(part_.data(), most_, count_, small_.data());
    forces_.head(n).setZero();
    for (int i = 0; i < count_; ++i) forces_[indices_[static_cast<std::size_t>(i)]] = small_[i];
    multiply(matrix_.data(), most_, n, forces_.data(), gaps_.data());
    const double force_floor = kRoundOff * (n > 0 ? forces_.head(n).cwiseAbs().maxCoeff() : 0.0);
    const double gap_floor = kRoundOff * greatest;
    int violated = 0, last = n;
    const auto is_violated = [&](int i) {
      return active_[static_cast<std::size_t>(i)]
                 ? forces_[i] < -force_floor
                 : gaps_[i] - depths[static_cast<std::size_t>(i)] < -gap_floor;
    };
    for (int i = 0; i < n; ++i) {
      if (!is_violated(i)) continue;
      ++violated;
      last = i;
    }
    if (violated == 0) {
      for (int i = 0; i < n; ++i) {
        forces_[i] = std::max(0.0, forces_[i]);
        figures.touching += forces_[i] > 0.0;
        figures.energy += 0.5 * forces_[i] * gaps_[i];
      }
      figures.converged = forces_.head(n).allFinite();
      if (!figures.converged) forces_.head(n).setZero();
      return figures;
    }
    const bool whole_block = violated < fewest || patience > 0;
    if (violated < fewest) {
      fewest = violated;
      patience = kPatience;
    } else {
      --patience;
    }
    for (int i = whole_block ? 0 : last; i <= last; ++i)
      if (is_violated(i)) active_[static_cast<std::size_t>(i)] ^= 1;
  }
  forces_.head(n).setZero();
  return figures;
}

}  // namespace viscera
