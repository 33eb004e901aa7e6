#include "kernels/paff/block_matrix.h"

#include <algorithm>
#include <limits>
#include <string>

namespace viscera {

SymmetricPattern symmetric_pattern(std::size_t node_count,
                                   std::initializer_list<IntegrationPoints> sets) {
  constexpr std::size_t kChunk = 64;
  struct Part {
    std::vector<std::size_t> counts;
    std::vector<int> columns;
  };
  std::vector<Part> parts((node_count + kChunk - 1) / kChunk);
  parallel_chunks(node_count, kChunk, [&](std::size_t first, std::size_t last) {
    Part& part = parts[first / kChunk];
    std::vector<int> seen_by(node_count, -1);
    for (std::size_t row = first; row < last; ++row) {
      const std::size_t start = part.columns.size();
      seen_by[row] = static_cast<int>(row);
      part.columns.push_back(static_cast<int>(row));
      for (const IntegrationPoints& set : sets) {
        for (const NodeIncidence::Entry& at : set.incidence.of(row)) {
          const std::size_t end = set.fields.begin[static_cast<std::size_t>(at.point) + 1];
          for (std::size_t e = at.entry; e < end; ++e) {
            const int column = set.fields.nodes[e];
            if (seen_by[static_cast<std::size_t>(column)] == static_cast<int>(row)) continue;
            seen_by[static_cast<std::size_t>(column)] = static_cast<int>(row);
            part.columns.push_back(column);
          }
        }
      }
      std::sort(part.columns.begin() + static_cast<std::ptrdiff_t>(start), part.columns.end());
      part.counts.push_back(part.columns.size() - start);
    }
  });
  SymmetricPattern pattern;
  pattern.row_begin.reserve(node_count + 1);
  for (const Part& part : parts) {
    for (const std::size_t count : part.counts) {
      pattern.row_begin.push_back(pattern.row_begin.back() + count);
    }
    pattern.columns.insert(pattern.columns.end(), part.columns.begin(), part.columns.end());
  }
  return pattern;
}

void SymmetricBlockMatrix::multiply(std::span<const double> x, std::span<double> out) const {
  const std::size_t w = static_cast<std::size_t>(width);
  std::fill(out.begin(), out.end(), 0.0);
  for (std::size_t row = 0; row < pattern.rows(); ++row) {
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      const std::size_t column = static_cast<std::size_t>(pattern.columns[e]);
      const double* block = blocks.data() + e * w * w;
      for (std::size_t i = 0; i < w; ++i) {
        for (std::size_t j = 0; j < w; ++j) {
          out[row * w + i] += block[i * w + j] * x[column * w + j];
          if (column != row) out[column * w + j] += block[i * w + j] * x[row * w + i];
        }
      }
    }
  }
}

std::size_t SymmetricBlockMatrix::nonzeros() const {
  const std::size_t blocks_both = 2 * pattern.columns.size() - pattern.rows();
  return blocks_both * static_cast<std::size_t>(width) * static_cast<std::size_t>(width);
}

Result<int> checked_order(const SymmetricBlockMatrix& matrix, std::string_view what) {
  const std::size_t order = static_cast<std::size_t>(matrix.width) * matrix.pattern.rows();
  if (order > 0 && order <= static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return static_cast<int>(order);
  return failure(std::string(what) + ": the matrix has " + std::to_string(order) +
                 " rows; expected 1 to 2^31 - 1");
}

}  // namespace viscera
