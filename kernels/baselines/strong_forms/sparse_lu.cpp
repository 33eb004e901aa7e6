#include "kernels/baselines/strong_forms/sparse_lu.h"

#include <limits>
#include <string>

namespace viscera {

void BlockRows::multiply(std::span<const double> x, std::span<double> out) const {
  for (std::size_t row = 0; row < rows(); ++row) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t e = row_begin[row]; e < row_begin[row + 1]; ++e) {
      sum += blocks[e] * Vec3::Map(x.data() + 3 * static_cast<std::size_t>(columns[e]));
    }
    Vec3::Map(out.data() + 3 * row) = sum;
  }
}

std::vector<double> BlockRows::residual(std::span<const double> b,
                                        std::span<const double> x) const {
  std::vector<double> out(b.size());
  for (std::size_t row = 0; row < rows(); ++row) {
    for (int i = 0; i < 3; ++i) {
      const std::size_t unknown = 3 * row + static_cast<std::size_t>(i);
      long double sum = b[unknown];
      for (std::size_t e = row_begin[row]; e < row_begin[row + 1]; ++e) {
        for (int j = 0; j < 3; ++j) {
          sum -= static_cast<long double>(blocks[e](i, j)) *
                 x[3 * static_cast<std::size_t>(columns[e]) + static_cast<std::size_t>(j)];
        }
      }
      out[unknown] = static_cast<double>(sum);
    }
  }
  return out;
}

Result<SparseLu> SparseLu::factor(const BlockRows& matrix, std::string_view what) {
  const std::size_t order = 3 * matrix.rows();
  if (order == 0 || order > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    return failure(std::string(what) + ": the matrix has " + std::to_string(order) +
                   " rows; expected 1 to 2^31 - 1");
  }
  CoordinateMatrix all;
  all.order = static_cast<int>(order);
  all.rows.reserve(matrix.nonzeros());
  all.columns.reserve(matrix.nonzeros());
  all.values.reserve(matrix.nonzeros());
  for (std::size_t row = 0; row < matrix.rows(); ++row) {
    for (std::size_t e = matrix.row_begin[row]; e < matrix.row_begin[row + 1]; ++e) {
      const std::size_t column = static_cast<std::size_t>(matrix.columns[e]);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          all.add(3 * row + static_cast<std::size_t>(i), 3 * column + static_cast<std::size_t>(j),
                  matrix.blocks[e](i, j));
        }
      }
    }
  }
  Result<MumpsFactor> factor = MumpsFactor::factor(all, MatrixKind::kUnsymmetric, 3, what);
  if (!factor) return std::unexpected(factor.error());
  return SparseLu(std::move(*factor));
}

}  // namespace viscera
