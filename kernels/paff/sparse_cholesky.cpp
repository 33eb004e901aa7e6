#include "kernels/paff/sparse_cholesky.h"

#include <limits>
#include <string>
#include <vector>

#include "kernels/paff/mumps_factor.h"

namespace viscera {

struct SparseCholesky::Factor {
  MumpsFactor mumps;
};

SparseCholesky::SparseCholesky(std::unique_ptr<Factor> factor) : factor_(std::move(factor)) {}
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

bool SparseCholesky::is_by_mumps() {
  return true;
}

Result<SparseCholesky> SparseCholesky::factor(const SymmetricBlockMatrix& matrix, double shift,
                                              std::string_view what) {
  const SymmetricPattern& pattern = matrix.pattern;
  const std::size_t w = static_cast<std::size_t>(matrix.width);
  const std::size_t order = w * pattern.rows();
  if (order == 0 || order > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    return failure(std::string(what) + ": the matrix has " + std::to_string(order) +
                   " rows; expected 1 to 2^31 - 1");
  }
  CoordinateMatrix upper;
  upper.order = static_cast<int>(order);
  upper.rows.reserve(pattern.columns.size() * w * w);
  upper.columns.reserve(upper.rows.capacity());
  upper.values.reserve(upper.rows.capacity());
  for (std::size_t row = 0; row < pattern.rows(); ++row) {
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      const std::size_t column = static_cast<std::size_t>(pattern.columns[e]);
      for (std::size_t i = 0; i < w; ++i) {
        for (std::size_t j = column == row ? i : 0; j < w; ++j) {
          const bool diagonal = column == row && i == j;
          upper.add(row * w + i, column * w + j,
                    matrix.blocks[e * w * w + i * w + j] + (diagonal ? shift : 0.0));
        }
      }
    }
  }
  Result<MumpsFactor> factor =
      MumpsFactor::factor(upper, MatrixKind::kPositiveDefinite, matrix.width, what);
  if (!factor) return std::unexpected(factor.error());
  return SparseCholesky(std::make_unique<Factor>(std::move(*factor)));
}

Result<void> SparseCholesky::solve(std::span<double> right_hand_sides, int columns) {
  return factor_->mumps.solve(right_hand_sides, columns);
}

std::size_t SparseCholesky::order() const {
  return factor_->mumps.order();
}

std::size_t SparseCholesky::factor_bytes() const {
  return factor_->mumps.factor_bytes();
}

}  // namespace viscera
