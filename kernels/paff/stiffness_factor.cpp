#include "kernels/paff/stiffness_factor.h"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>

#include "kernels/base/parallel.h"
#include "kernels/paff/blas.h"
#include "kernels/paff/compliance_columns.h"
#include "kernels/paff/inverse_products.h"
#include "kernels/paff/preparation_cost.h"

namespace viscera {
namespace {

/// Touchable places of a block of columns: wide enough for matrix products at full speed.
constexpr std::size_t kPlacesAtOnce = 64;
/// Blocks between two looks at the progress.
constexpr std::size_t kBlocksAtOnce = 8;
/// Of the answer to a load that changes from node to node; single entries err up to ten times as
/// much.
constexpr double kSingleIsEnough = 1e-5;
/// Of a known answer by a factor in double precision: sound bodies come to 1e-12 to 1e-8.
constexpr double kLeastExact = 1e-6;
/// Of the answer to an even pull, which errs about as much as the compliance: that may err by 1e-4.
constexpr double kEnoughForPulls = 7e-5;

std::string gigabytes(std::size_t bytes) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << 1e-9 * static_cast<double>(bytes) << " GB";
  return text.str();
}

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

/// How wrong an answer of a factor is, by one step of refinement.
double error_of(const SymmetricBlockMatrix& stiffness, const FrontalCholesky<float>& factor,
                std::span<const double> load) {
  const std::size_t n = load.size();
  std::vector<double> x(n), residual(n), change(n);
  apply(factor, load, x);
  stiffness.multiply(x, residual);
  for (std::size_t i = 0; i < n; ++i) residual[i] = load[i] - residual[i];
  apply(factor, residual, change);
  const double size = norm(x);
  return size > 0.0 ? norm(change) / size : std::numeric_limits<double>::infinity();
}

/// Whether a factor in single precision is good enough. A load that changes from node to node finds
/// how it errs in the stiff ways of a body; a pull along each axis, in the soft ones, where it errs
/// most: of some nodes at random the first alone said 5e-6, the pulls 3e-4, and the compliance was
/// wrong by 1.5e-4.
bool is_enough(const SymmetricBlockMatrix& stiffness, const FrontalCholesky<float>& factor) {
  const std::size_t n = 3 * stiffness.pattern.rows();
  std::vector<double> load(n);
  for (std::size_t i = 0; i < n; ++i) load[i] = std::sin(1.0 + static_cast<double>(i));
  if (!(error_of(stiffness, factor, load) < kSingleIsEnough)) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < n; ++i) load[i] = i % 3 == axis ? 1.0 : 0.0;
    if (!(error_of(stiffness, factor, load) < kEnoughForPulls)) return false;
  }
  return true;
}

/// How wrong the answer to the loads of a known one comes back: the body turned by a little and
/// stretched, u = (y - z, 2 z - x, x + y). Fields that nearly repeat each other, as of nodes that
/// crowd, lose as many digits as the stiffness against their difference is smaller than the rest.
double error_of_known(const SymmetricBlockMatrix& stiffness, const FrontalCholesky<double>& factor,
                      std::span<const Vec3> positions) {
  std::vector<double> known, load(3 * positions.size()), answer(load.size());
  for (const Vec3& x : positions) {
    const Vec3 u = x - positions.front();
    known.insert(known.end(), {u.y() - u.z(), 2.0 * u.z() - u.x(), u.x() + u.y()});
  }
  stiffness.multiply(known, load);
  apply(factor, load, answer);
  for (std::size_t i = 0; i < known.size(); ++i) answer[i] -= known[i];
  const double size = norm(known);
  return size > 0.0 ? norm(answer) / size : 0.0;
}

/// Columns of a compliance by blocks of touchable places that act early and near each other.
template <class Real>
class ColumnBlocks {
 public:
  ColumnBlocks(const FrontalCholesky<Real>& factor, const SparseWeights& places,
               std::span<const int> touchable)
      : factor_(factor),
        dissection_(factor.dissection()),
        places_(places),
        touchable_(touchable.begin(), touchable.end()),
        unit_of_(places.rows(), kNoUnit) {
    for (std::size_t t = 0; t < touchable_.size(); ++t) {
      const auto place = static_cast<std::size_t>(touchable_[t]);
      int first = std::numeric_limits<int>::max();
      for_each_entry(place, [&](int position, Real) { first = std::min(first, position); });
      units_.push_back({first, place, t});
    }
    std::sort(units_.begin(), units_.end(), [](const Unit& a, const Unit& b) {
      return a.position != b.position ? a.position < b.position : a.place < b.place;
    });
    for (std::size_t u = 0; u < units_.size(); ++u) unit_of_[units_[u].place] = u;
    always_wanted_.assign(dissection_.fronts.size(), 0);
    for (std::size_t place = 0; place < places.rows(); ++place) {
      if (unit_of_[place] == kNoUnit) mark(place, always_wanted_);
    }
  }

  /// All columns at once from products of columns of the inverse factor, where that is less work.
  bool product_is_cheaper() const {
    double solving = 0.0;
    for (const Dissection::Front& front : dissection_.fronts) {
      const auto own = static_cast<double>(front.own());
      solving += own * (0.5 * own + static_cast<double>(front.border.size()));
    }
    // Forward and back; the mirror of the touchable square and loads that act late save a quarter.
    solving *= 0.75 * 2.0 * 27.0 * static_cast<double>(units_.size());
    return inverse_products_cost(dissection_, 3, places_, touchable_) < solving;
  }

  void compute_by_product(float* columns) const {
    const std::vector<Real> products = inverse_products<Real>(factor_, places_, touchable_);
    parallel_for_each_index((products.size() + kCopied - 1) / kCopied, 1, [&](std::size_t part) {
      const std::size_t end = std::min(products.size(), (part + 1) * kCopied);
      for (std::size_t i = part * kCopied; i < end; ++i) {
        columns[i] = static_cast<float>(products[i]);
      }
    });
  }

  std::size_t count() const { return (units_.size() + kPlacesAtOnce - 1) / kPlacesAtOnce; }

  std::size_t block_of(std::size_t place) const { return unit_of_[place] / kPlacesAtOnce; }

  /// Which rows of a block are made: those that `mirror` doesn't fill, or all.
  enum class Rows { kUnmirrored, kAll };

  void compute(std::size_t index, Rows rows, float* to) const {
    const std::size_t first = index * kPlacesAtOnce;
    const std::size_t last = std::min(units_.size(), first + kPlacesAtOnce);
    const std::size_t columns = 3 * (last - first);
    typename FrontalCholesky<Real>::FrontMask active(dissection_.fronts.size(), 0);
    auto wanted =
        rows == Rows::kAll ? std::vector<char>(dissection_.fronts.size(), 1) : always_wanted_;
    std::vector<Real> block(3 * dissection_.order.size() * columns, Real(0));
    for (std::size_t u = first; u < last; ++u) {
      mark(units_[u].place, active);
      for_each_entry(units_[u].place, [&](int position, Real weight) {
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t unknown = 3 * static_cast<std::size_t>(position) + k;
          block[unknown * columns + 3 * (u - first) + k] += weight;
        }
      });
    }
    // Rows of touchable places of earlier blocks are the mirror of columns of theirs.
    if (rows == Rows::kUnmirrored)
      for (std::size_t u = first; u < units_.size(); ++u) mark(units_[u].place, wanted);
    factor_.solve(block, static_cast<int>(columns), active, wanted);

    std::vector<Real> row(3 * columns);
    for (std::size_t place = 0; place < places_.rows(); ++place) {
      if (rows == Rows::kUnmirrored && unit_of_[place] != kNoUnit && unit_of_[place] < first)
        continue;
      std::fill(row.begin(), row.end(), Real(0));
      for_each_entry(place, [&](int position, Real weight) {
        const Real* in = block.data() + 3 * static_cast<std::size_t>(position) * columns;
        for (std::size_t c = 0; c < row.size(); ++c) row[c] += weight * in[c];
      });
      for (std::size_t c = 0; c < columns; ++c) {
        const std::size_t column = 3 * units_[first + c / 3].column + c % 3;
        float* out = to + column * 3 * places_.rows() + 3 * place;
        for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<float>(row[k * columns + c]);
      }
    }
  }

  /// The touchable square, from the columns of the place that comes first of each pair in the order
  /// of the blocks.
  void mirror(float* columns) const {
    mirror_square(columns, [&](std::size_t i) { return units_[i].column; });
  }
  /// The same where places come first in their own order.
  void mirror_product(float* columns) const {
    mirror_square(columns, [](std::size_t i) { return i; });
  }

 private:
  static constexpr std::size_t kNoUnit = std::numeric_limits<std::size_t>::max();
  static constexpr std::size_t kCopied = 1 << 16;  // numbers of a task

  struct Unit {
    int position;        // first of its nodes in the order of elimination
    std::size_t place;   // row triple
    std::size_t column;  // column triple
  };

  template <class Visit>
  void for_each_entry(std::size_t place, const Visit& visit) const {
    for (int e = places_.row_begin[place]; e < places_.row_begin[place + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      visit(dissection_.position[static_cast<std::size_t>(places_.nodes[entry])],
            static_cast<Real>(places_.values[entry]));
    }
  }

  template <class ColumnOf>
  void mirror_square(float* columns, const ColumnOf& column_of) const {
    constexpr std::size_t kTile = 32;
    const std::size_t rows = 3 * places_.rows();
    const auto row_of = [&](std::size_t column) {
      return 3 * static_cast<std::size_t>(touchable_[column]);
    };
    parallel_chunks(units_.size(), kTile, [&](std::size_t later_begin, std::size_t later_end) {
      for (std::size_t earlier_begin = 0; earlier_begin < later_end; earlier_begin += kTile) {
        for (std::size_t later = later_begin; later < later_end; ++later) {
          const std::size_t earlier_end = std::min(later + 1, earlier_begin + kTile);
          for (std::size_t earlier = earlier_begin; earlier < earlier_end; ++earlier) {
            const std::size_t a = column_of(earlier), b = column_of(later);
            for (std::size_t i = 0; i < 3; ++i) {
              for (std::size_t j = 0; j < (a == b ? i : 3); ++j) {
                columns[(3 * b + i) * rows + row_of(a) + j] =
                    columns[(3 * a + j) * rows + row_of(b) + i];
              }
            }
          }
        }
      }
    });
  }

  /// Marks the fronts of a place's nodes and all above them.
  void mark(std::size_t place, std::vector<char>& mask) const {
    for_each_entry(place, [&](int position, Real) {
      int f = dissection_.front_of[static_cast<std::size_t>(position)];
      while (f >= 0 && !mask[static_cast<std::size_t>(f)]) {
        mask[static_cast<std::size_t>(f)] = 1;
        f = dissection_.fronts[static_cast<std::size_t>(f)].parent;
      }
    });
  }

  const FrontalCholesky<Real>& factor_;
  const Dissection& dissection_;
  const SparseWeights& places_;
  std::vector<int> touchable_;
  std::vector<Unit> units_;           // in the order of elimination
  std::vector<std::size_t> unit_of_;  // of each place
  std::vector<char> always_wanted_;
};

std::vector<int> first_of(std::size_t count) {
  std::vector<int> all(count);
  for (std::size_t p = 0; p < all.size(); ++p) all[p] = static_cast<int>(p);
  return all;
}

/// Whole blocks, from a factor that it keeps.
template <class Real>
class FactorColumns final : public ColumnSource {
 public:
  FactorColumns(std::shared_ptr<const StiffnessFactor> owner, const FrontalCholesky<Real>& factor,
                const SparseWeights& places, std::size_t touchable)
      : owner_(std::move(owner)), places_(places), blocks_(factor, places_, first_of(touchable)) {
    prepare_blas();
  }

  std::size_t blocks() const override { return blocks_.count(); }
  std::size_t block_of(int touchable) const override {
    return blocks_.block_of(static_cast<std::size_t>(touchable));
  }
  void make(std::size_t block, float* columns) const override {
    blocks_.compute(block, ColumnBlocks<Real>::Rows::kAll, columns);
  }
  std::size_t memory_bytes() const override { return owner_->factor_bytes(); }

 private:
  std::shared_ptr<const StiffnessFactor> owner_;
  SparseWeights places_;
  ColumnBlocks<Real> blocks_;
};

/// Panels of fronts, one after another.
template <class Real>
std::vector<Real> packed_panels(const FrontalCholesky<Real>& factor) {
  std::vector<Real> packed;
  packed.reserve(factor.factor_bytes() / sizeof(Real));
  for (std::size_t f = 0; f < factor.dissection().fronts.size(); ++f)
    packed.insert(packed.end(), factor.panel(f), factor.panel(f) + factor.panel_size(f));
  return packed;
}

/// Fails for what is no dissection.
Result<Dissection> dissection_of(const PackedFactor& packed) {
  const Error broken = failure("its fronts don't fit each other").error();
  Dissection dissection;
  dissection.order = packed.order;
  const std::size_t nodes = packed.order.size();
  dissection.position.assign(nodes, -1);
  dissection.front_of.assign(nodes, -1);
  for (std::size_t p = 0; p < nodes; ++p) {
    const int node = packed.order[p];
    if (node < 0 || static_cast<std::size_t>(node) >= nodes) return std::unexpected(broken);
    int& position = dissection.position[static_cast<std::size_t>(node)];
    if (position >= 0) return std::unexpected(broken);
    position = static_cast<int>(p);
  }
  std::size_t border = 0;
  int next = 0;
  const std::size_t count = packed.fronts.size() / PackedFactor::kNumbersAFront;
  for (std::size_t f = 0; f < count; ++f) {
    const int* numbers = packed.fronts.data() + PackedFactor::kNumbersAFront * f;
    Dissection::Front front;
    front.first = numbers[0];
    front.last = numbers[1];
    front.parent = numbers[2];
    const int size = numbers[3];
    // A root is its own end; any other front comes before its parent.
    const bool placed = front.first == next && front.last >= front.first &&
                        static_cast<std::size_t>(front.last) <= nodes &&
                        (front.parent == -1 || (front.parent > static_cast<int>(f) &&
                                                front.parent < static_cast<int>(count)));
    if (!placed || size < 0 || static_cast<std::size_t>(size) > packed.borders.size() - border)
      return std::unexpected(broken);
    front.border.assign(packed.borders.begin() + static_cast<std::ptrdiff_t>(border),
                        packed.borders.begin() + static_cast<std::ptrdiff_t>(border) + size);
    int before = front.last - 1;
    for (const int position : front.border) {
      if (position <= before || static_cast<std::size_t>(position) >= nodes)
        return std::unexpected(broken);
      before = position;
    }
    for (int p = front.first; p < front.last; ++p)
      dissection.front_of[static_cast<std::size_t>(p)] = static_cast<int>(f);
    next = front.last;
    border += static_cast<std::size_t>(size);
    dissection.fronts.push_back(std::move(front));
  }
  for (std::size_t f = 0; f < count; ++f)
    if (const int parent = dissection.fronts[f].parent; parent >= 0)
      dissection.fronts[static_cast<std::size_t>(parent)].children.push_back(static_cast<int>(f));
  if (static_cast<std::size_t>(next) != nodes || border != packed.borders.size() || nodes == 0)
    return std::unexpected(broken);
  return dissection;
}

}  // namespace

std::shared_ptr<const ColumnSource> StiffnessFactor::columns(
    std::shared_ptr<const StiffnessFactor> factor, const SparseWeights& places) {
  return columns(std::move(factor), places, places.rows());
}

std::shared_ptr<const ColumnSource> StiffnessFactor::columns(
    std::shared_ptr<const StiffnessFactor> factor, const SparseWeights& places,
    std::size_t touchable) {
  return std::visit(
      [&]<class Real>(const FrontalCholesky<Real>& fronts) -> std::shared_ptr<const ColumnSource> {
        return std::make_shared<FactorColumns<Real>>(factor, fronts, places, touchable);
      },
      factor->factor_);
}

PackedFactor StiffnessFactor::pack() const {
  PackedFactor packed;
  std::visit(
      [&]<class Real>(const FrontalCholesky<Real>& factor) {
        const Dissection& dissection = factor.dissection();
        packed.order = dissection.order;
        for (const Dissection::Front& front : dissection.fronts) {
          const int size = static_cast<int>(front.border.size());
          for (const int number : {front.first, front.last, front.parent, size})
            packed.fronts.push_back(number);
          packed.borders.insert(packed.borders.end(), front.border.begin(), front.border.end());
        }
        if constexpr (std::is_same_v<Real, float>)
          packed.single_panels = packed_panels(factor);
        else
          packed.full_panels = packed_panels(factor);
      },
      factor_);
  return packed;
}

Result<StiffnessFactor> StiffnessFactor::unpack(const PackedFactor& packed) {
  auto dissection = dissection_of(packed);
  if (!dissection) return std::unexpected(dissection.error());
  const auto shared = std::make_shared<const Dissection>(std::move(*dissection));
  if (!packed.single_panels.empty()) {
    auto single = FrontalCholesky<float>::of_panels(shared, packed.single_panels);
    if (!single) return std::unexpected(single.error());
    return StiffnessFactor(std::move(*single));
  }
  auto full = FrontalCholesky<double>::of_panels(shared, packed.full_panels);
  if (!full) return std::unexpected(full.error());
  return StiffnessFactor(std::move(*full));
}

Result<StiffnessFactor> StiffnessFactor::factor(const SymmetricBlockMatrix& stiffness,
                                                std::span<const Vec3> positions,
                                                FactorPrecision precision,
                                                std::size_t most_memory) {
  constexpr const char* kWhat = "stiffness";
  if (stiffness.width != 3 || stiffness.pattern.rows() != positions.size() || positions.empty()) {
    return failure("stiffness: " + std::to_string(stiffness.pattern.rows()) +
                   " rows of blocks given for " + std::to_string(positions.size()) +
                   " nodes; expected as many, of width 3, and at least one");
  }
  const auto dissection = std::make_shared<const Dissection>(dissect(positions, stiffness.pattern));
  const auto fits = [&](std::size_t real_bytes, const char* what) -> Result<void> {
    const std::size_t needed =
        elimination_bytes(*dissection, real_bytes, oneapi::tbb::this_task_arena::max_concurrency());
    if (needed <= most_memory) return {};
    return failure("stiffness: found " + std::to_string(positions.size()) + " nodes that need " +
                   gigabytes(needed) + " to be factored in " + what +
                   " precision, expected at most " + gigabytes(most_memory) +
                   ": fewer nodes, or a lower Poisson's ratio");
  };
  if (precision != FactorPrecision::kFull) {
    if (auto has_room = fits(sizeof(float), "single"); !has_room)
      return std::unexpected(has_room.error());
    auto single = FrontalCholesky<float>::factor(stiffness, dissection, kWhat);
    const bool asked_for = precision == FactorPrecision::kSingle;
    if (!single && asked_for) return std::unexpected(single.error());
    if (single && (asked_for || is_enough(stiffness, *single))) {
      return StiffnessFactor(std::move(*single));
    }
  }
  if (auto has_room = fits(sizeof(double), "double"); !has_room)
    return std::unexpected(has_room.error());
  auto full = FrontalCholesky<double>::factor(stiffness, dissection, kWhat);
  if (!full) return std::unexpected(full.error());
  if (const double error = error_of_known(stiffness, *full, positions); !(error < kLeastExact)) {
    std::ostringstream text;
    text << kWhat << ": a known answer comes back wrong by " << error << " of it; expected "
         << kLeastExact
         << " at most: remove nodes that crowd at one place, or hold more of the body";
    return failure(text.str());
  }
  return StiffnessFactor(std::move(*full));
}

void StiffnessFactor::apply(std::span<const double> b, std::span<double> x) const {
  std::visit([&](const auto& factor) { viscera::apply(factor, b, x); }, factor_);
}

void StiffnessFactor::apply(std::span<float> block, int columns) const {
  std::visit(
      [&]<class Real>(const FrontalCholesky<Real>& factor) {
        const std::vector<int>& order = factor.dissection().order;
        const std::size_t row = 3 * static_cast<std::size_t>(columns);
        std::vector<Real> ordered(block.size());
        for (std::size_t p = 0; p < order.size(); ++p)
          std::copy_n(
              block.begin() + static_cast<std::ptrdiff_t>(row * static_cast<std::size_t>(order[p])),
              row, ordered.begin() + static_cast<std::ptrdiff_t>(row * p));
        factor.solve(ordered, columns);
        for (std::size_t p = 0; p < order.size(); ++p)
          for (std::size_t i = 0; i < row; ++i)
            block[row * static_cast<std::size_t>(order[p]) + i] =
                static_cast<float>(ordered[row * p + i]);
      },
      factor_);
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

Result<SurfaceCompliance> StiffnessFactor::compliance(const SparseWeights& places,
                                                      std::vector<int> touchable,
                                                      const Progress& progress) const {
  const std::size_t nodes =
      std::visit([](const auto& factor) { return factor.dissection().order.size(); }, factor_);
  Result<SurfaceCompliance> compliance =
      empty_compliance(nodes, places, std::move(touchable), true);
  if (!compliance) return compliance;
  const Result<void> filled = std::visit(
      [&]<class Real>(const FrontalCholesky<Real>& factor) -> Result<void> {
        using Blocks = ColumnBlocks<Real>;
        const Blocks blocks(factor, places, compliance->touchable);
        float* columns = compliance->columns.data();
        if (blocks.product_is_cheaper()) {
          if (!progress(0.0, "computing compliance")) return failure(kCancelled);
          blocks.compute_by_product(columns);
          blocks.mirror_product(columns);
          return {};
        }
        for (std::size_t first = 0; first < blocks.count(); first += kBlocksAtOnce) {
          if (!progress(static_cast<double>(first) / static_cast<double>(blocks.count()),
                        "computing compliance")) {
            return failure(kCancelled);
          }
          const std::size_t last = std::min(blocks.count(), first + kBlocksAtOnce);
          parallel_for_each_index(last - first, 1, [&](std::size_t b) {
            blocks.compute(first + b, Blocks::Rows::kUnmirrored, columns);
          });
        }
        blocks.mirror(columns);
        return {};
      },
      factor_);
  if (!filled) return std::unexpected(filled.error());
  if (!progress(1.0, "computing compliance")) return failure(kCancelled);
  return compliance;
}

std::size_t StiffnessFactor::nodes() const {
  return std::visit([](const auto& factor) { return factor.dissection().order.size(); }, factor_);
}

std::size_t StiffnessFactor::factor_bytes() const {
  return std::visit([](const auto& factor) { return factor.factor_bytes(); }, factor_);
}

}  // namespace viscera
