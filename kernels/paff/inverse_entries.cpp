#include "kernels/paff/inverse_entries.h"

#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/paff/blas.h"

namespace viscera {
namespace {

constexpr std::size_t kTile = 512;  // rows and columns of a task

/// Consecutive entries of a sorted list.
struct Range {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

/// Of each front, the entries of a list of positions that lie in its part of the body: in itself
/// and the fronts under it, which stand one after another.
std::vector<Range> ranges_of_parts(const Dissection& dissection, std::span<const int> positions) {
  std::vector<Range> ranges(dissection.fronts.size());
  std::vector<int> first(dissection.fronts.size());
  const auto at = [&](int position) {
    return static_cast<std::size_t>(std::lower_bound(positions.begin(), positions.end(), position) -
                                    positions.begin());
  };
  for (std::size_t f = 0; f < ranges.size(); ++f) {
    const Dissection::Front& front = dissection.fronts[f];
    first[f] = front.first;
    for (const int child : front.children) {
      first[f] = std::min(first[f], first[static_cast<std::size_t>(child)]);
    }
    ranges[f] = {at(first[f]), at(front.last)};
  }
  return ranges;
}

template <class Body>
void for_each_tile(std::size_t rows, std::size_t columns, const Body& body) {
  const std::size_t row_tiles = (rows + kTile - 1) / kTile;
  const std::size_t column_tiles = (columns + kTile - 1) / kTile;
  parallel_chunks(row_tiles * column_tiles, 1, [&](std::size_t at, std::size_t) {
    const std::size_t i = (at % row_tiles) * kTile, j = (at / row_tiles) * kTile;
    body(i, j, std::min(kTile, rows - i), std::min(kTile, columns - j));
  });
}

int integer(std::size_t n) {
  return static_cast<int>(n);
}

template <class Real>
class InverseEntries {
 public:
  InverseEntries(const FrontalCholesky<Real>& factor, std::span<const int> rows,
                 std::span<const int> columns)
      : factor_(factor),
        dissection_(factor.dissection()),
        w_(static_cast<std::size_t>(factor.width())),
        rows_(rows),
        columns_(columns),
        same_(rows.size() == columns.size()),
        row_ranges_(ranges_of_parts(dissection_, rows)),
        column_ranges_(ranges_of_parts(dissection_, columns)),
        left_(dissection_.fronts.size()),
        out_(w_ * rows.size() * w_ * columns.size(), Real(0)) {
    for (const int position : columns) {
      const auto found = std::lower_bound(rows.begin(), rows.end(), position);
      row_of_column_.push_back(static_cast<std::size_t>(found - rows.begin()));
    }
  }

  std::vector<Real> run() {
    for (std::size_t f = 0; f < dissection_.fronts.size(); ++f) {
      if (dissection_.fronts[f].parent < 0) climb(f);
    }
    return std::move(out_);
  }

 private:
  void climb(std::size_t f) {
    if (row_ranges_[f].size() == 0) return;
    const std::vector<int>& children = dissection_.fronts[f].children;
    parallel_for_each_index(children.size(), 1,
                            [&](std::size_t c) { climb(static_cast<std::size_t>(children[c])); });
    eliminate(f);
  }

  /// Transposed columns of Y at a front: one row for each unit load, one column for each unknown.
  void eliminate(std::size_t f) {
    const Dissection::Front& front = dissection_.fronts[f];
    const std::size_t own = w_ * front.own(), size = w_ * front.size(), rest = size - own;
    const std::size_t loads = w_ * row_ranges_[f].size();
    std::vector<Real> solved(loads * own, Real(0));
    std::vector<Real>& left = left_[f];
    left.assign(loads * rest, Real(0));
    take_children(f, solved, left);
    for (std::size_t r = row_ranges_[f].begin; r < row_ranges_[f].end; ++r) {
      if (rows_[r] < front.first) continue;
      for (std::size_t k = 0; k < w_; ++k) {
        const std::size_t unknown = w_ * static_cast<std::size_t>(rows_[r] - front.first) + k;
        solved[w_ * (r - row_ranges_[f].begin) + k + unknown * loads] = Real(1);
      }
    }
    if (own == 0) return;
    const Real* panel = factor_.panel(f);
    for_each_tile(loads, 1, [&](std::size_t i, std::size_t, std::size_t count, std::size_t) {
      blas::solve_right(true, integer(count), integer(own), panel, integer(size), solved.data() + i,
                        integer(loads));
    });
    for_each_tile(loads, rest, [&](std::size_t i, std::size_t j, std::size_t m, std::size_t n) {
      blas::multiply(true, integer(m), integer(n), integer(own), Real(-1), solved.data() + i,
                     integer(loads), panel + own + j, integer(size), Real(1),
                     left.data() + i + j * loads, integer(loads));
    });
    multiply_into_result(f, solved, loads, own);
  }

  void take_children(std::size_t f, std::vector<Real>& solved, std::vector<Real>& left) {
    const Dissection::Front& front = dissection_.fronts[f];
    const std::size_t loads = w_ * row_ranges_[f].size();
    for (const int child : front.children) {
      const auto c = static_cast<std::size_t>(child);
      const Dissection::Front& from = dissection_.fronts[c];
      const std::size_t child_loads = w_ * row_ranges_[c].size();
      if (child_loads == 0) continue;
      const std::size_t offset = w_ * (row_ranges_[c].begin - row_ranges_[f].begin);
      parallel_for_each_index(from.border.size(), 32, [&](std::size_t b) {
        const int position = from.border[b];
        Real* to = nullptr;
        if (position < front.last) {
          to = solved.data() + w_ * static_cast<std::size_t>(position - front.first) * loads;
        } else {
          const auto place = std::lower_bound(front.border.begin(), front.border.end(), position);
          to = left.data() + w_ * static_cast<std::size_t>(place - front.border.begin()) * loads;
        }
        const Real* source = left_[c].data() + w_ * b * child_loads;
        for (std::size_t k = 0; k < w_; ++k) {
          std::copy_n(source + k * child_loads, child_loads, to + k * loads + offset);
        }
      });
      left_[c] = {};
    }
  }

  void multiply_into_result(std::size_t f, const std::vector<Real>& solved, std::size_t loads,
                            std::size_t own) {
    const Range& rows = row_ranges_[f];
    const Range& columns = column_ranges_[f];
    if (columns.size() == 0) return;
    const std::size_t height = w_ * rows_.size();
    const std::size_t count = w_ * columns.size();
    const Real* right = solved.data();
    std::vector<Real> chosen;
    if (!same_) {
      chosen.resize(count * own);
      parallel_for_each_index(own, 64, [&](std::size_t u) {
        for (std::size_t c = 0; c < columns.size(); ++c) {
          const std::size_t row = row_of_column_[columns.begin + c] - rows.begin;
          std::copy_n(solved.data() + w_ * row + u * loads, w_, chosen.data() + w_ * c + u * count);
        }
      });
      right = chosen.data();
    }
    Real* out = out_.data() + w_ * rows.begin + w_ * columns.begin * height;
    for_each_tile(loads, count, [&](std::size_t i, std::size_t j, std::size_t m, std::size_t n) {
      if (same_ && i < j) return;
      blas::multiply(true, integer(m), integer(n), integer(own), Real(1), solved.data() + i,
                     integer(loads), right + j, integer(count), Real(1), out + i + j * height,
                     integer(height));
    });
  }

  const FrontalCholesky<Real>& factor_;
  const Dissection& dissection_;
  std::size_t w_;
  std::span<const int> rows_, columns_;
  bool same_;
  std::vector<Range> row_ranges_, column_ranges_;
  std::vector<std::size_t> row_of_column_;
  std::vector<std::vector<Real>> left_;  // of each front, for its parent: loads x border
  std::vector<Real> out_;
};

}  // namespace

template <class Real>
std::vector<Real> inverse_entries(const FrontalCholesky<Real>& factor, std::span<const int> rows,
                                  std::span<const int> columns) {
  return InverseEntries<Real>(factor, rows, columns).run();
}

template std::vector<float> inverse_entries(const FrontalCholesky<float>&, std::span<const int>,
                                            std::span<const int>);
template std::vector<double> inverse_entries(const FrontalCholesky<double>&, std::span<const int>,
                                             std::span<const int>);

double inverse_entries_cost(const Dissection& dissection, int width, std::span<const int> rows,
                            std::span<const int> columns) {
  const std::vector<Range> row_ranges = ranges_of_parts(dissection, rows);
  const std::vector<Range> column_ranges = ranges_of_parts(dissection, columns);
  const double w3 = static_cast<double>(width) * width * width;
  double cost = 0.0;
  for (std::size_t f = 0; f < dissection.fronts.size(); ++f) {
    const auto own = static_cast<double>(dissection.fronts[f].own());
    const auto border = static_cast<double>(dissection.fronts[f].border.size());
    const auto height = static_cast<double>(row_ranges[f].size());
    const auto count = static_cast<double>(column_ranges[f].size());
    const double product = rows.size() == columns.size() ? 0.5 * height : height;
    cost += own * (height * (0.5 * own + border) + product * count);
  }
  return w3 * cost;
}

}  // namespace viscera
