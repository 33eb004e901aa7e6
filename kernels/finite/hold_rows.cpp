#include "kernels/finite/hold_rows.h"

#include <algorithm>
#include <cstring>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

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
      Block& to = blocks_.emplace_back();
      to.fill(0.0f);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k)
          to[4 * k + i] = static_cast<float>(
              matrix.blocks[9 * entry.block + (entry.transposed ? 3 * k + i : 3 * i + k)]);
    }
    begin_.push_back(columns_.size());
  }
}

VISCERA_WIDE void HoldRows::multiply_rows(const HoldRows& rows, std::size_t begin, std::size_t end,
                                          const double* u, double* forces) {
  using Lanes = double __attribute__((vector_size(32)));
  using FloatLanes = float __attribute__((vector_size(16)));
  for (std::size_t row = begin; row < end; ++row) {
    Lanes sum = {};
    for (std::size_t e = rows.begin_[row]; e < rows.begin_[row + 1]; ++e) {
      const double* at = u + 3 * static_cast<std::size_t>(rows.columns_[e]);
      for (std::size_t k = 0; k < 3; ++k) {
        FloatLanes column;
        std::memcpy(&column, rows.blocks_[e].data() + 4 * k, sizeof(column));
        sum += at[k] * __builtin_convertvector(column, Lanes);
      }
    }
    std::memcpy(forces + 4 * row, &sum, sizeof(sum));
  }
}

void HoldRows::multiply(const std::vector<double>& u, std::vector<double>& forces) const {
  forces.resize(4 * nodes_.size());
  parallel_chunks(nodes_.size(), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
    multiply_rows(*this, begin, end, u.data(), forces.data());
  });
}

std::size_t HoldRows::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return of(nodes_) + of(begin_) + of(columns_) + of(blocks_);
}

}  // namespace viscera
