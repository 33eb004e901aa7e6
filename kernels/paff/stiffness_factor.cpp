#include "kernels/paff/stiffness_factor.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kernels/base/parallel.h"
#include "kernels/paff/compliance_columns.h"
#include "kernels/paff/inverse_entries.h"

namespace viscera {
namespace {

/// Touchable nodes of a block of columns: wide enough for matrix products at full speed.
constexpr std::size_t kNodesAtOnce = 64;
/// Blocks between two looks at the progress.
constexpr std::size_t kBlocksAtOnce = 8;
/// Of the answer to one load all over the body; single entries err up to five times as much.
constexpr double kSingleIsEnough = 2e-5;

double norm(std::span<const double> x) {
  double sum = 0.0;
  for (const double value : x) sum += value * value;
  return std::sqrt(sum);
}

double dot(std::span<const double> x, std::span<const double> y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
  return sum;
}

/// x ~ K^-1 b in the precision of the factor.
template <class Real>
void apply(const FrontalCholesky<Real>& factor, std::span<const double> b, std::span<double> x) {
  const std::vector<int>& order = factor.dissection().order;
  // Single precision holds numbers of 1e-38 to 1e38 only; loads and stiffness may be far from 1.
  const double size = norm(b);
  const double scale = size > 0.0 ? 1.0 / size : 1.0;
  std::vector<Real> block(b.size());
  for (std::size_t p = 0; p < order.size(); ++p) {
    for (std::size_t k = 0; k < 3; ++k) {
      block[3 * p + k] = static_cast<Real>(scale * b[3 * static_cast<std::size_t>(order[p]) + k]);
    }
  }
  factor.solve(block, 1);
  for (std::size_t p = 0; p < order.size(); ++p) {
    for (std::size_t k = 0; k < 3; ++k) {
      x[3 * static_cast<std::size_t>(order[p]) + k] = static_cast<double>(block[3 * p + k]) / scale;
    }
  }
}

/// Conjugate gradients for K x = b from x = 0, until the residual has shrunk by `tolerance` or no
/// longer shrinks.
template <class Real>
void conjugate_gradients(const SymmetricBlockMatrix& stiffness, const FrontalCholesky<Real>& factor,
                         std::span<const double> b, double tolerance, std::vector<double>& x) {
  constexpr int kMostSteps = 60;
  const std::size_t n = b.size();
  std::vector<double> residual(b.begin(), b.end()), z(n), direction(n), product(n);
  x.assign(n, 0.0);
  const double wanted = tolerance * norm(b);
  double rho = 0.0;
  for (int step = 0; step < kMostSteps && norm(residual) > wanted; ++step) {
    apply(factor, residual, z);
    const double next = dot(residual, z);
    if (!(next > 0.0)) return;
    const double beta = step > 0 ? next / rho : 0.0;
    rho = next;
    for (std::size_t i = 0; i < n; ++i) direction[i] = z[i] + beta * direction[i];
    stiffness.multiply(direction, product);
    const double curvature = dot(direction, product);
    if (!(curvature > 0.0)) return;
    const double length = rho / curvature;
    for (std::size_t i = 0; i < n; ++i) {
      x[i] += length * direction[i];
      residual[i] -= length * product[i];
    }
  }
}

/// Refines until the true residual no longer shrinks tenfold.
template <class Real>
Result<void> refined_solve(const SymmetricBlockMatrix& stiffness,
                           const FrontalCholesky<Real>& factor, std::span<double> column) {
  constexpr int kMostRounds = 6;
  constexpr double kAccepted = 1e-8;
  const std::vector<double> b(column.begin(), column.end());
  const double size = norm(b);
  if (size == 0.0) return {};
  if (!std::isfinite(size)) return failure("stiffness: a load isn't finite");
  std::vector<double> x(b.size(), 0.0), residual = b, change, product(b.size()), tried(b.size());
  double best = size;
  for (int round = 0; round < kMostRounds; ++round) {
    conjugate_gradients(stiffness, factor, residual, 1e-6, change);
    for (std::size_t i = 0; i < b.size(); ++i) tried[i] = x[i] + change[i];
    stiffness.multiply(tried, product);
    for (std::size_t i = 0; i < b.size(); ++i) product[i] = b[i] - product[i];
    const double left = norm(product);
    if (!(left < best)) break;
    const bool slow = left > 0.1 * best;
    x.swap(tried);
    residual.swap(product);
    best = left;
    if (slow || best == 0.0) break;
  }
  if (!(best < kAccepted * size)) {
    return failure("stiffness: a solution missed its load by " + std::to_string(best / size) +
                   " of it; expected less than 1e-8: the body is hardly held, or its Poisson's "
                   "ratio too near to 0.5");
  }
  std::copy(x.begin(), x.end(), column.begin());
  return {};
}

/// How wrong an answer of a factor is, by one step of refinement on a load all over the body.
double error_of(const SymmetricBlockMatrix& stiffness, const FrontalCholesky<float>& factor) {
  const std::size_t n = 3 * stiffness.pattern.rows();
  std::vector<double> load(n), x(n), residual(n), change(n);
  for (std::size_t i = 0; i < n; ++i) load[i] = std::sin(1.0 + static_cast<double>(i));
  apply(factor, load, x);
  stiffness.multiply(x, residual);
  for (std::size_t i = 0; i < n; ++i) residual[i] = load[i] - residual[i];
  apply(factor, residual, change);
  const double size = norm(x);
  return size > 0.0 ? norm(change) / size : std::numeric_limits<double>::infinity();
}

/// Columns of a compliance by blocks of touchable nodes that are eliminated one after another.
template <class Real>
class ColumnBlocks {
 public:
  ColumnBlocks(const FrontalCholesky<Real>& factor, SurfaceCompliance& compliance)
      : factor_(factor), dissection_(factor.dissection()), compliance_(compliance) {
    std::vector<char> is_touchable(dissection_.order.size(), 0);
    for (std::size_t t = 0; t < compliance.touchable.size(); ++t) {
      const auto node = static_cast<std::size_t>(compliance.touchable[t]);
      is_touchable[node] = 1;
      units_.push_back({dissection_.position[node], t});
    }
    std::sort(units_.begin(), units_.end(),
              [](const Unit& a, const Unit& b) { return a.position < b.position; });
    always_wanted_.assign(dissection_.fronts.size(), 0);
    for (const int node : compliance.visible) {
      const auto i = static_cast<std::size_t>(node);
      positions_.push_back(dissection_.position[i]);
      if (!is_touchable[i]) mark(dissection_.position[i], always_wanted_);
      skippable_.push_back(is_touchable[i]);
    }
  }

  /// All columns at once from products of columns of the inverse factor, where that is less work.
  bool product_is_cheaper() const {
    const std::vector<int> rows = sorted_positions(), columns = unit_positions();
    double solving = 0.0;
    for (const Dissection::Front& front : dissection_.fronts) {
      const auto own = static_cast<double>(front.own());
      solving += own * (0.5 * own + static_cast<double>(front.border.size()));
    }
    // Forward and back; the mirror of the touchable square and loads that act late save a quarter.
    solving *= 0.75 * 2.0 * 27.0 * static_cast<double>(units_.size());
    return inverse_entries_cost(dissection_, 3, rows, columns) < solving;
  }

  void compute_by_product() const {
    const std::vector<int> row_positions = sorted_positions(), columns = unit_positions();
    const std::vector<Real> entries = inverse_entries<Real>(factor_, row_positions, columns);
    const std::size_t rows = compliance_.rows();
    std::vector<std::size_t> entry_row;  // of each visible node
    for (const int position : positions_) {
      const auto found = std::lower_bound(row_positions.begin(), row_positions.end(), position);
      entry_row.push_back(3 * static_cast<std::size_t>(found - row_positions.begin()));
    }
    parallel_for_each_index(3 * units_.size(), 16, [&](std::size_t c) {
      const Real* in = entries.data() + c * rows;
      float* out = compliance_.columns.data() + (3 * units_[c / 3].touchable + c % 3) * rows;
      for (std::size_t v = 0; v < entry_row.size(); ++v) {
        for (std::size_t k = 0; k < 3; ++k) {
          out[3 * v + k] = static_cast<float>(in[entry_row[v] + k]);
        }
      }
    });
  }

  std::size_t count() const { return (units_.size() + kNodesAtOnce - 1) / kNodesAtOnce; }

  void compute(std::size_t index) const {
    const std::size_t first = index * kNodesAtOnce;
    const std::size_t last = std::min(units_.size(), first + kNodesAtOnce);
    const std::size_t columns = 3 * (last - first);
    typename FrontalCholesky<Real>::FrontMask active(dissection_.fronts.size(), 0);
    auto wanted = always_wanted_;
    std::vector<Real> block(3 * dissection_.order.size() * columns, Real(0));
    for (std::size_t u = first; u < last; ++u) {
      mark(units_[u].position, active);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t unknown = 3 * static_cast<std::size_t>(units_[u].position) + k;
        block[unknown * columns + 3 * (u - first) + k] = Real(1);
      }
    }
    // Rows of touchable nodes eliminated earlier are the mirror of columns of another block.
    for (std::size_t u = first; u < units_.size(); ++u) mark(units_[u].position, wanted);
    factor_.solve(block, static_cast<int>(columns), active, wanted);

    constexpr std::size_t kRowTile = 16;  // of nodes: the part of the block stays in the cache
    const std::size_t rows = compliance_.rows();
    for (std::size_t begin = 0; begin < positions_.size(); begin += kRowTile) {
      const std::size_t end = std::min(positions_.size(), begin + kRowTile);
      for (std::size_t c = 0; c < columns; ++c) {
        const std::size_t column = 3 * units_[first + c / 3].touchable + c % 3;
        float* out = compliance_.columns.data() + column * rows;
        for (std::size_t v = begin; v < end; ++v) {
          if (skippable_[v] && positions_[v] < units_[first].position) continue;
          const Real* in = block.data() + 3 * static_cast<std::size_t>(positions_[v]) * columns + c;
          for (std::size_t k = 0; k < 3; ++k) out[3 * v + k] = static_cast<float>(in[k * columns]);
        }
      }
    }
  }

  /// The touchable square, from the columns of the node that is eliminated first of each pair.
  void mirror() const {
    constexpr std::size_t kTile = 32;
    const std::size_t rows = compliance_.rows();
    const std::vector<std::size_t> row_of = compliance_.touchable_rows();
    float* columns = compliance_.columns.data();
    parallel_chunks(units_.size(), kTile, [&](std::size_t later_begin, std::size_t later_end) {
      for (std::size_t earlier_begin = 0; earlier_begin < later_end; earlier_begin += kTile) {
        for (std::size_t later = later_begin; later < later_end; ++later) {
          const std::size_t earlier_end = std::min(later + 1, earlier_begin + kTile);
          for (std::size_t earlier = earlier_begin; earlier < earlier_end; ++earlier) {
            const std::size_t a = 3 * units_[earlier].touchable, b = 3 * units_[later].touchable;
            for (std::size_t i = 0; i < 3; ++i) {
              for (std::size_t j = 0; j < (a == b ? i : 3); ++j) {
                columns[(b + i) * rows + row_of[a + j]] = columns[(a + j) * rows + row_of[b + i]];
              }
            }
          }
        }
      }
    });
  }

 private:
  struct Unit {
    int position;
    std::size_t touchable;  // index
  };

  std::vector<int> sorted_positions() const {
    std::vector<int> sorted = positions_;
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }
  std::vector<int> unit_positions() const {
    std::vector<int> positions;
    for (const Unit& unit : units_) positions.push_back(unit.position);
    return positions;
  }

  /// Marks the front of a position and all above it.
  void mark(int position, std::vector<char>& mask) const {
    int f = dissection_.front_of[static_cast<std::size_t>(position)];
    while (f >= 0 && !mask[static_cast<std::size_t>(f)]) {
      mask[static_cast<std::size_t>(f)] = 1;
      f = dissection_.fronts[static_cast<std::size_t>(f)].parent;
    }
  }

  const FrontalCholesky<Real>& factor_;
  const Dissection& dissection_;
  SurfaceCompliance& compliance_;
  std::vector<Unit> units_;      // in the order of elimination
  std::vector<int> positions_;   // of the visible nodes
  std::vector<char> skippable_;  // visible nodes that are touchable
  std::vector<char> always_wanted_;
};

}  // namespace

Result<StiffnessFactor> StiffnessFactor::factor(const SymmetricBlockMatrix& stiffness,
                                                std::span<const Vec3> positions,
                                                FactorPrecision precision) {
  constexpr const char* kWhat = "stiffness";
  if (stiffness.width != 3 || stiffness.pattern.rows() != positions.size() || positions.empty()) {
    return failure("stiffness: " + std::to_string(stiffness.pattern.rows()) +
                   " rows of blocks given for " + std::to_string(positions.size()) +
                   " nodes; expected as many, of width 3, and at least one");
  }
  const auto dissection = std::make_shared<const Dissection>(dissect(positions, stiffness.pattern));
  if (precision != FactorPrecision::full) {
    auto single = FrontalCholesky<float>::factor(stiffness, dissection, kWhat);
    const bool asked_for = precision == FactorPrecision::single;
    if (!single && asked_for) return std::unexpected(single.error());
    if (single && (asked_for || error_of(stiffness, *single) < kSingleIsEnough)) {
      return StiffnessFactor(std::move(*single));
    }
  }
  auto full = FrontalCholesky<double>::factor(stiffness, dissection, kWhat);
  if (!full) return std::unexpected(full.error());
  return StiffnessFactor(std::move(*full));
}

Result<void> StiffnessFactor::solve(const SymmetricBlockMatrix& stiffness,
                                    std::span<double> right_hand_sides, int columns) const {
  const std::size_t order = 3 * stiffness.pattern.rows();
  if (columns < 0 || right_hand_sides.size() != order * static_cast<std::size_t>(columns)) {
    return failure("stiffness: " + std::to_string(right_hand_sides.size()) + " numbers given for " +
                   std::to_string(columns) + " right-hand sides; expected " +
                   std::to_string(order) + " each");
  }
  std::vector<Result<void>> solved(static_cast<std::size_t>(columns));
  parallel_for_each_index(solved.size(), 1, [&](std::size_t c) {
    const auto column = right_hand_sides.subspan(c * order, order);
    solved[c] = std::visit(
        [&](const auto& factor) { return refined_solve(stiffness, factor, column); }, factor_);
  });
  for (const Result<void>& one : solved) {
    if (!one) return one;
  }
  return {};
}

Result<SurfaceCompliance> StiffnessFactor::compliance(std::vector<int> visible,
                                                      std::vector<int> touchable,
                                                      const Progress& progress) const {
  const std::size_t nodes =
      std::visit([](const auto& factor) { return factor.dissection().order.size(); }, factor_);
  Result<SurfaceCompliance> compliance =
      empty_compliance(nodes, std::move(visible), std::move(touchable), true);
  if (!compliance) return compliance;
  const Result<void> filled = std::visit(
      [&](const auto& factor) -> Result<void> {
        const ColumnBlocks blocks(factor, *compliance);
        if (blocks.product_is_cheaper()) {
          if (!progress(0.0, "computing compliance")) return failure(kCancelled);
          blocks.compute_by_product();
          blocks.mirror();
          return {};
        }
        for (std::size_t first = 0; first < blocks.count(); first += kBlocksAtOnce) {
          if (!progress(static_cast<double>(first) / static_cast<double>(blocks.count()),
                        "computing compliance")) {
            return failure(kCancelled);
          }
          const std::size_t last = std::min(blocks.count(), first + kBlocksAtOnce);
          parallel_for_each_index(last - first, 1,
                                  [&](std::size_t b) { blocks.compute(first + b); });
        }
        blocks.mirror();
        return {};
      },
      factor_);
  if (!filled) return std::unexpected(filled.error());
  if (!progress(1.0, "computing compliance")) return failure(kCancelled);
  return compliance;
}

std::size_t StiffnessFactor::factor_bytes() const {
  return std::visit([](const auto& factor) { return factor.factor_bytes(); }, factor_);
}

}  // namespace viscera
