// The inverse of a large body's stiffness without its factor: smoothing on its own nodes, and a
// factor of the same body on every tenth of them [Briggs2000]. It takes a tenth of the memory that
// a factor of all nodes takes, and a hundredth of its operations.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/columns_on_demand.h"
#include "kernels/paff/compact_factor.h"
#include "kernels/paff/rest_stiffness.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {

/// One symmetric cycle over two levels, H ~ K^-1: Chebyshev smoothing [Adams2003] by the inverses
/// of the blocks of small groups of nodes, K on a coarser cloud (P^T K P, P linear fields of the
/// coarse nodes), and smoothing again. H is a fixed matrix, symmetric and positive, and K^-1 - H
/// positive, too: no step by it goes too far. Immutable; safe from many threads at once, with the
/// same bits for any number of them.
class TwoLevels {
 public:
  /// Least distance of coarse nodes over the local spacing.
  static constexpr double kCoarser = 2.0;

  /// `spacings` of the nodes [m]. `coarse`: what an earlier one had factored; null: it is factored.
  /// Fails where K isn't positive definite.
  static Result<TwoLevels> make(RestStiffness stiffness, std::span<const Vec3> positions,
                                std::span<const double> spacings,
                                std::shared_ptr<const StiffnessFactor> coarse = nullptr);

  /// x = H b (3 N).
  void apply(std::span<const double> b, std::span<double> x) const;

  /// x = H b, or K^-1 b to `kSolved`, of columns stored row by row (3 N x columns), in single
  /// precision.
  void apply(std::vector<float>& columns, std::size_t count) const;
  void solve(std::vector<float>& columns, std::size_t count) const;
  /// Of the answer's energy, squared.
  static constexpr double kSolved = 1e-6;

  enum class Columns { kCycle, kSolved };
  /// Columns of H or of K^-1 for places before `touchable` among the rows of `places`, in blocks of
  /// a few places near each other.
  static std::shared_ptr<const ColumnSource> columns(std::shared_ptr<const TwoLevels> levels,
                                                     Columns kind, const SparseWeights& places,
                                                     std::size_t touchable);

  std::size_t nodes() const { return stiffness_.nodes(); }
  std::size_t coarse_nodes() const { return coarse_->nodes(); }
  const std::shared_ptr<const StiffnessFactor>& coarse() const { return coarse_; }
  const RestStiffness& stiffness() const { return stiffness_; }
  /// Of a node in an order in which near ones follow each other.
  int rank(int node) const { return rank_[static_cast<std::size_t>(node)]; }
  std::size_t memory_bytes() const;

 private:
  explicit TwoLevels(RestStiffness stiffness) : stiffness_(std::move(stiffness)) {}

  std::vector<int> choose_coarse(std::span<const Vec3> positions, std::span<const double> spacings);
  void prolong_from(std::span<const int> chosen, std::span<const Vec3> positions,
                    std::span<const double> spacings);
  SymmetricBlockMatrix coarse_stiffness(std::size_t coarse) const;
  Result<void> invert_groups(std::span<const Vec3> positions);
  void bound_smoother();

  /// z = D^-1 r.
  void apply_groups(const float* r, float* z, std::size_t columns) const;
  /// x += the smoother's answer to r, which becomes what is left.
  void smooth(std::vector<float>& x, std::vector<float>& r, std::size_t columns,
              bool keep_residual) const;
  void correct(std::vector<float>& x, std::vector<float>& r, std::size_t columns) const;

  RestStiffness stiffness_;
  // Of each node: coarse nodes and weights; and the way back.
  std::vector<std::size_t> up_begin_, down_begin_;
  std::vector<int> up_, down_;
  std::vector<float> up_weights_, down_weights_;
  std::shared_ptr<const StiffnessFactor> coarse_;
  std::unique_ptr<const CompactFactor> compact_;  // the same in sixteen bits
  // Groups of nodes near each other, and the inverses of their blocks, symmetric, column by column.
  std::vector<std::size_t> group_begin_{0}, inverse_begin_{0};
  std::vector<int> grouped_, rank_;
  std::vector<float> inverses_;
  double least_ = 0.0, greatest_ = 0.0;  // eigenvalues of D^-1 K that are smoothed
};

}  // namespace viscera
