#include "kernels/paff/frontal_cholesky.h"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <string>

#include "kernels/base/parallel.h"
#include "kernels/paff/blas.h"
#include "kernels/paff/tiled_cholesky.h"

namespace viscera {
namespace {

/// Entries (row, column) of the matrix by row of the full pattern: the blocks below the diagonal of
/// a column, in the order of elimination.
struct LowerBlocks {
  struct Entry {
    int row;            // position
    std::size_t block;  // in the matrix
    bool transposed;    // the stored block is (column, row)
  };
  std::vector<std::size_t> begin;  // of each position
  std::vector<Entry> entries;

  LowerBlocks(const SymmetricPattern& pattern, const std::vector<int>& position)
      : begin(pattern.rows() + 1, 0), entries(pattern.columns.size()) {
    const auto each = [&](const auto& visit) {
      for (std::size_t i = 0; i < pattern.rows(); ++i) {
        for (std::size_t e = pattern.row_begin[i]; e < pattern.row_begin[i + 1]; ++e) {
          const int a = position[i], b = position[static_cast<std::size_t>(pattern.columns[e])];
          // Stored is block (a, b); wanted is (later, earlier).
          visit(std::min(a, b), Entry{std::max(a, b), e, a < b});
        }
      }
    };
    each([&](int column, const Entry&) { ++begin[static_cast<std::size_t>(column) + 1]; });
    for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    each([&](int column, const Entry& entry) {
      entries[next[static_cast<std::size_t>(column)]++] = entry;
    });
  }
};

/// Factors the fronts of one matrix: each sums its entries and what its children leave, eliminates
/// its own nodes, and leaves the rest to its parent.
template <class Real>
class Elimination {
 public:
  Elimination(const SymmetricBlockMatrix& matrix, const Dissection& dissection,
              std::vector<std::vector<Real>>& panels)
      : matrix_(matrix),
        dissection_(dissection),
        lower_(matrix.pattern, dissection.position),
        width_(static_cast<std::size_t>(matrix.width)),
        panels_(panels),
        rests_(dissection.fronts.size()) {}

  /// False where a pivot isn't positive.
  bool run() {
    for (std::size_t f = 0; f < dissection_.fronts.size(); ++f) {
      if (dissection_.fronts[f].parent < 0) eliminate_tree(static_cast<int>(f));
    }
    return !failed_;
  }

 private:
  void eliminate_tree(int f) {
    const std::vector<int>& children = dissection_.fronts[static_cast<std::size_t>(f)].children;
    parallel_for_each_index(children.size(), 1,
                            [&](std::size_t c) { eliminate_tree(children[c]); });
    // A thread that waits within a front begins no other tree, whose fronts would stand beside it.
    if (!failed_)
      oneapi::tbb::this_task_arena::isolate([&] { eliminate_front(static_cast<std::size_t>(f)); });
  }

  void eliminate_front(std::size_t f) {
    const Dissection::Front& front = dissection_.fronts[f];
    const std::size_t own = width_ * front.own(), size = width_ * front.size(), rest = size - own;
    std::vector<Real>& panel = panels_[f];
    std::vector<Real>& update = rests_[f];
    panel.assign(size * own, Real(0));
    update.assign(rest * rest, Real(0));

    std::vector<int> place(dissection_.order.size(), -1);  // of a position, in this front
    for (int p = front.first; p < front.last; ++p)
      place[static_cast<std::size_t>(p)] = p - front.first;
    for (std::size_t b = 0; b < front.border.size(); ++b) {
      place[static_cast<std::size_t>(front.border[b])] = static_cast<int>(front.own() + b);
    }
    add_entries(front, place, panel, size);
    for (const int child : front.children) {
      add_child(static_cast<std::size_t>(child), front, place, panel, update);
      std::vector<Real>().swap(rests_[static_cast<std::size_t>(child)]);  // = {} keeps its memory
    }
    if (!eliminate(size, own, panel.data(), update.data())) failed_ = true;
  }

  void add_entries(const Dissection::Front& front, const std::vector<int>& place,
                   std::vector<Real>& panel, std::size_t size) const {
    parallel_for_each_index(front.own(), 64, [&](std::size_t c) {
      const std::size_t p = static_cast<std::size_t>(front.first) + c;
      for (std::size_t e = lower_.begin[p]; e < lower_.begin[p + 1]; ++e) {
        const LowerBlocks::Entry& entry = lower_.entries[e];
        const auto row = static_cast<std::size_t>(place[static_cast<std::size_t>(entry.row)]);
        const double* block = matrix_.blocks.data() + entry.block * width_ * width_;
        for (std::size_t i = 0; i < width_; ++i) {
          for (std::size_t j = 0; j < width_; ++j) {
            const double value = entry.transposed ? block[j * width_ + i] : block[i * width_ + j];
            panel[width_ * row + i + (width_ * c + j) * size] += static_cast<Real>(value);
          }
        }
      }
    });
  }

  void add_child(std::size_t child, const Dissection::Front& front, const std::vector<int>& place,
                 std::vector<Real>& panel, std::vector<Real>& update) const {
    const Dissection::Front& from = dissection_.fronts[child];
    const std::vector<Real>& left = rests_[child];
    const std::size_t height = width_ * from.border.size();
    const std::size_t own = width_ * front.own(), size = width_ * front.size(), rest = size - own;
    parallel_for_each_index(from.border.size(), 32, [&](std::size_t b) {
      const auto to = static_cast<std::size_t>(place[static_cast<std::size_t>(from.border[b])]);
      for (std::size_t j = 0; j < width_; ++j) {
        const Real* source = left.data() + (width_ * b + j) * height;
        const std::size_t column = width_ * to + j;
        Real* target = column < own ? panel.data() + column * size
                                    : update.data() + (column - own) * rest - own;
        for (std::size_t r = b; r < from.border.size(); ++r) {
          const std::size_t row =
              width_ * static_cast<std::size_t>(place[static_cast<std::size_t>(from.border[r])]);
          for (std::size_t i = 0; i < width_; ++i) target[row + i] += source[width_ * r + i];
        }
      }
    });
  }

  const SymmetricBlockMatrix& matrix_;
  const Dissection& dissection_;
  LowerBlocks lower_;
  std::size_t width_;
  std::vector<std::vector<Real>>& panels_;
  std::vector<std::vector<Real>> rests_;
  std::atomic<bool> failed_ = false;
};

}  // namespace

template <class Real>
Result<FrontalCholesky<Real>> FrontalCholesky<Real>::factor(
    const SymmetricBlockMatrix& matrix, std::shared_ptr<const Dissection> dissection,
    std::string_view what) {
  prepare_blas();
  FrontalCholesky out;
  out.width_ = matrix.width;
  out.entries_ = dissection->factor_entries(matrix.width);
  out.panels_.resize(dissection->fronts.size());
  if (!Elimination<Real>(matrix, *dissection, out.panels_).run()) {
    return failure(std::string(what) +
                   ": the matrix is singular or not positive definite; expected a body held firmly "
                   "and nodes all over it");
  }
  out.dissection_ = std::move(dissection);
  return out;
}

template <class Real>
Result<FrontalCholesky<Real>> FrontalCholesky<Real>::of_panels(
    std::shared_ptr<const Dissection> dissection, std::span<const Real> panels) {
  FrontalCholesky out;
  const auto width = static_cast<std::size_t>(out.width_);
  out.entries_ = dissection->factor_entries(out.width_);
  std::size_t at = 0;
  for (const Dissection::Front& front : dissection->fronts) {
    const std::size_t size = width * front.size() * width * front.own();
    if (size > panels.size() - at) return failure("its panels end too early");
    const auto from = panels.begin() + static_cast<std::ptrdiff_t>(at);
    out.panels_.emplace_back(from, from + static_cast<std::ptrdiff_t>(size));
    at += size;
  }
  if (at != panels.size()) return failure("it has more panels than fronts");
  out.dissection_ = std::move(dissection);
  return out;
}

template <class Real>
void FrontalCholesky<Real>::solve(std::vector<Real>& block, int columns, const FrontMask& active,
                                  const FrontMask& wanted) const {
  // Stored by unknown, the block is (columns x order) column-major: X^T. With A = L L^T,
  // Y^T = B^T L^-T and X^T = Y^T L^-1, front by front.
  const auto c = static_cast<std::size_t>(columns), w = static_cast<std::size_t>(width_);
  std::vector<Real> border;
  const auto at = [&](int position) {
    return block.data() + c * w * static_cast<std::size_t>(position);
  };
  const auto as_int = [](std::size_t n) { return static_cast<int>(n); };
  for (std::size_t f = 0; f < panels_.size(); ++f) {
    const Dissection::Front& front = dissection_->fronts[f];
    const std::size_t own = w * front.own(), size = w * front.size(), rest = size - own;
    if (!active[f] || own == 0) continue;
    const Real* panel = panels_[f].data();
    blas::solve_right(true, columns, as_int(own), panel, as_int(size), at(front.first), columns);
    if (rest == 0) continue;
    border.resize(c * rest);
    blas::multiply(true, columns, as_int(rest), as_int(own), Real(1), at(front.first), columns,
                   panel + own, as_int(size), Real(0), border.data(), columns);
    for (std::size_t b = 0; b < front.border.size(); ++b) {
      Real* to = at(front.border[b]);
      const Real* from = border.data() + b * w * c;
      for (std::size_t i = 0; i < w * c; ++i) to[i] -= from[i];
    }
  }
  for (std::size_t f = panels_.size(); f-- > 0;) {
    const Dissection::Front& front = dissection_->fronts[f];
    const std::size_t own = w * front.own(), size = w * front.size(), rest = size - own;
    if (!wanted[f] || own == 0) continue;
    const Real* panel = panels_[f].data();
    if (rest > 0) {
      border.resize(c * rest);
      for (std::size_t b = 0; b < front.border.size(); ++b) {
        std::copy_n(at(front.border[b]), w * c, border.data() + b * w * c);
      }
      blas::multiply(false, columns, as_int(own), as_int(rest), Real(-1), border.data(), columns,
                     panel + own, as_int(size), Real(1), at(front.first), columns);
    }
    blas::solve_right(false, columns, as_int(own), panel, as_int(size), at(front.first), columns);
  }
}

template <class Real>
void FrontalCholesky<Real>::solve(std::vector<Real>& block, int columns) const {
  const FrontMask all(panels_.size(), 1);
  solve(block, columns, all, all);
}

template class FrontalCholesky<float>;
template class FrontalCholesky<double>;

}  // namespace viscera
