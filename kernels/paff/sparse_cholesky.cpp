#include "kernels/paff/sparse_cholesky.h"

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
  const Result<int> order = checked_order(matrix, what);
  if (!order) return std::unexpected(order.error());
  CoordinateMatrix upper;
  upper.order = *order;
  upper.rows.reserve(matrix.blocks.size());
  upper.columns.reserve(upper.rows.capacity());
  upper.values.reserve(upper.rows.capacity());
  each_upper_entry(matrix, shift, [&](std::size_t row, std::size_t column, double value) {
    upper.add(row, column, value);
  });
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
