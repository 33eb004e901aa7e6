// SparseCholesky in a build without MUMPS.
#include <Eigen/SparseCholesky>
#include <limits>
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
  const SymmetricPattern& pattern = matrix.pattern;
  const std::size_t w = static_cast<std::size_t>(matrix.width);
  const std::size_t order = w * pattern.rows();
  if (order == 0 || order > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    return failure(std::string(what) + ": the matrix has " + std::to_string(order) +
                   " rows; expected 1 to 2^31 - 1");
  }
  // The upper triangle's rows are the lower one's columns.
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(pattern.columns.size() * w * w);
  for (std::size_t row = 0; row < pattern.rows(); ++row) {
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      const std::size_t column = static_cast<std::size_t>(pattern.columns[e]);
      for (std::size_t i = 0; i < w; ++i) {
        for (std::size_t j = column == row ? i : 0; j < w; ++j) {
          const bool diagonal = column == row && i == j;
          entries.emplace_back(static_cast<int>(column * w + j), static_cast<int>(row * w + i),
                               matrix.blocks[e * w * w + i * w + j] + (diagonal ? shift : 0.0));
        }
      }
    }
  }
  Matrix lower(static_cast<Eigen::Index>(order), static_cast<Eigen::Index>(order));
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
