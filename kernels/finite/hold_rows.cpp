#include "kernels/finite/hold_rows.h"

#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/finite/point_lanes.h"

namespace viscera {
namespace {

using namespace point_lanes;

constexpr std::size_t kRowsAtOnce = 32;

}  // namespace

HoldRows::HoldRows(const SymmetricBlockMatrix& matrix) {
  const SymmetricPattern& pattern = matrix.pattern;
  struct Entry {
    int column;
    std::size_t block;
    bool transposed;
  };
  std::vector<std::vector<Entry>> rows(pattern.rows());
  for (std::size_t row = 0; row < pattern.rows(); ++row)
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      const double* block = matrix.blocks.data() + 9 * e;
      if (std::all_of(block, block + 9, [](double value) { return value == 0.0; })) continue;
      const auto column = static_cast<std::size_t>(pattern.columns[e]);
      rows[row].push_back({pattern.columns[e], e, false});
      if (column != row) rows[column].push_back({static_cast<int>(row), e, true});
    }
  std::vector<int> number(rows.size(), -1);
  for (std::size_t node = 0; node < rows.size(); ++node) {
    if (rows[node].empty()) continue;
    number[node] = static_cast<int>(nodes_.size());
    nodes_.push_back(static_cast<int>(node));
  }
  for (const int node : nodes_) {
    auto& row = rows[static_cast<std::size_t>(node)];
    std::ranges::sort(row, {}, &Entry::column);
    for (const Entry& entry : row) {
      columns_.push_back(number[static_cast<std::size_t>(entry.column)]);
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i)
          numbers_.push_back(static_cast<float>(
              matrix.blocks[9 * entry.block + (entry.transposed ? 3 * k + i : 3 * i + k)]));
    }
    begin_.push_back(columns_.size());
  }
  numbers_.push_back(0.0f);
}

template <std::size_t kVectors>
VISCERA_INLINE void HoldRows::multiply_rows(const HoldRows& rows, std::size_t begin,
                                            std::size_t end, const double* u, double* forces) {
  const std::size_t nodes = rows.nodes_.size();
  for (std::size_t row = begin; row < end; ++row) {
    Lanes sums[kVectors] = {};
    for (std::size_t e = rows.begin_[row]; e < rows.begin_[row + 1]; ++e) {
      const double* at = u + 3 * static_cast<std::size_t>(rows.columns_[e]);
      const float* block = rows.numbers_.data() + 9 * e;
      __builtin_prefetch(block + 9 * kEntriesAhead);
      for (std::size_t k = 0; k < 3; ++k) {
        Lanes column;
        load(block + 3 * k, column);
        for (std::size_t v = 0; v < kVectors; ++v) sums[v] += at[3 * nodes * v + k] * column;
      }
    }
    for (std::size_t v = 0; v < kVectors; ++v) store(sums[v], forces + 4 * (nodes * v + row));
  }
}

VISCERA_WIDE void HoldRows::multiply_one(const HoldRows& rows, std::size_t begin, std::size_t end,
                                         const double* u, double* forces) {
  multiply_rows<1>(rows, begin, end, u, forces);
}
VISCERA_WIDE void HoldRows::multiply_three(const HoldRows& rows, std::size_t begin, std::size_t end,
                                           const double* u, double* forces) {
  multiply_rows<3>(rows, begin, end, u, forces);
}

void HoldRows::multiply(const std::vector<double>& u, std::vector<double>& forces,
                        std::size_t vectors) const {
  forces.resize(4 * nodes_.size() * vectors);
  for (std::size_t v = 0; v < vectors;) {
    const std::size_t together = vectors - v < 3 ? 1 : 3;
    const auto rows = together == 1 ? multiply_one : multiply_three;
    parallel_chunks(nodes_.size(), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
      rows(*this, begin, end, u.data() + 3 * nodes_.size() * v,
           forces.data() + 4 * nodes_.size() * v);
    });
    v += together;
  }
}

std::size_t HoldRows::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return of(nodes_) + of(begin_) + of(columns_) + of(numbers_);
}

}  // namespace viscera
