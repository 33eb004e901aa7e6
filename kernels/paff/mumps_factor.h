// One MUMPS instance [Amestoy2001]: analysed, factored, ready for right-hand sides. Internal to the
// sparse solvers.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// A sparse matrix as coordinates from 1, each place at most once; for a symmetric one the upper
/// triangle.
struct CoordinateMatrix {
  int order = 0;
  std::vector<int> rows, columns;
  std::vector<double> values;

  void add(std::size_t row, std::size_t column, double value) {
    rows.push_back(static_cast<int>(row) + 1);
    columns.push_back(static_cast<int>(column) + 1);
    values.push_back(value);
  }
};

enum class MatrixKind { kPositiveDefinite, kUnsymmetric };

/// Owns the MUMPS instance; movable. BLAS is held to one thread, so that results don't depend on
/// the number of threads. MUMPS itself isn't safe from several threads at once: calls of all
/// instances queue for one lock.
class MumpsFactor {
 public:
  /// `block` unknowns of a node stand together and are ordered as one; `what` names the matrix in
  /// messages. Fails on a matrix that is singular, or not positive definite where it should be, and
  /// when memory runs out.
  static Result<MumpsFactor> factor(const CoordinateMatrix& matrix, MatrixKind kind, int block,
                                    std::string_view what);
  ~MumpsFactor();
  MumpsFactor(MumpsFactor&&) noexcept;
  MumpsFactor& operator=(MumpsFactor&&) noexcept;

  /// A x = b in place; `columns` right-hand sides, column-major (order x columns).
  Result<void> solve(std::span<double> right_hand_sides, int columns);

  /// Column k of `out` (order x columns, column-major) becomes A^-1 b_k, with b_k given by
  /// values[e] at rows[e], e in [begin[k], begin[k + 1]). Skips the parts of the forward
  /// elimination where the vectors are zero.
  Result<void> solve_sparse(std::span<const int> begin, std::span<const int> rows,
                            std::span<const double> values, std::span<double> out);

  std::size_t order() const;
  std::size_t factor_bytes() const;

 private:
  struct Instance;
  explicit MumpsFactor(std::unique_ptr<Instance> instance);
  std::unique_ptr<Instance> instance_;
};

}  // namespace viscera
