// SparseCholesky in a build without MUMPS.
#include <Eigen/SparseCholesky>
#include <string>
#include <vector>

#include "kernels/paff/sparse_cholesky.h"

namespace viscera {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Columns = Eigen::Map<Eigen::MatrixXd>;

}  // namespace

struct SparseCholesky::Factor {
  Eigen::SimplicialLLT<Matrix> eigen;
  std::string what;
};

SparseCholesky::SparseCholesky(std::unique_ptr<Factor> factor) : factor_(std::move(factor)) {}
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

bool SparseCholesky::is_by_mumps() {
  return false;
}

Result<SparseCholesky> SparseCholesky::factor(const SymmetricBlockMatrix& matrix, double shift,
                                              std::string_view what) {
  const Result<int> order = checked_order(matrix, what);
  if (!order) return std::unexpected(order.error());
  // The upper triangle's rows are the lower one's columns.
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(matrix.blocks.size());
  each_upper_entry(matrix, shift, [&](std::size_t row, std::size_t column, double value) {
    entries.emplace_back(static_cast<int>(column), static_cast<int>(row), value);
  });
  Matrix lower(*order, *order);
  lower.setFromTriplets(entries.begin(), entries.end());
  auto factor = std::make_unique<Factor>();
  factor->what = what;
  factor->eigen.compute(lower);
  if (factor->eigen.info() != Eigen::Success) {
    return failure(factor->what +
                   ": the matrix is not positive definite; expected a body held firmly and nodes "
                   "all over it");
  }
  return SparseCholesky(std::move(factor));
}

Result<void> SparseCholesky::solve(std::span<double> right_hand_sides, int columns) {
  if (columns < 0 || right_hand_sides.size() != order() * static_cast<std::size_t>(columns)) {
    return failure(factor_->what + ": " + std::to_string(right_hand_sides.size()) +
                   " numbers given for " + std::to_string(columns) +
                   " right-hand sides; expected " + std::to_string(order()) + " each");
  }
  if (columns == 0) return {};
  Columns all(right_hand_sides.data(), static_cast<Eigen::Index>(order()), columns);
  all = factor_->eigen.solve(all).eval();
  return {};
}

std::size_t SparseCholesky::order() const {
  return static_cast<std::size_t>(factor_->eigen.rows());
}

std::size_t SparseCholesky::factor_bytes() const {
  return static_cast<std::size_t>(factor_->eigen.matrixL().nestedExpression().nonZeros()) *
         (sizeof(double) + sizeof(int));
}

}  // namespace viscera
