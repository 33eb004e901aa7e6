// What holds a body, as a matrix that is multiplied thousands of times a second.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/paff/block_matrix.h"

namespace viscera {

/// A symmetric matrix of blocks of 3 over the nodes that it touches: whole rows, in single
/// precision, so that each is a sum of its own.
class HoldRows {
 public:
  HoldRows() = default;
  /// Blocks of nothing but zeros are left out.
  explicit HoldRows(const SymmetricBlockMatrix& matrix);

  /// Those that it touches, ascending                                                        (n)
  const std::vector<int>& nodes() const { return nodes_; }

  /// forces = B u for these nodes, four numbers a node, the last of them no force; of some vectors,
  /// one after another. Reading B is what takes time, and it is read once for three of them.
  /// Parallel, with the same bits for any number of threads and of vectors.
  void multiply(const std::vector<double>& u, std::vector<double>& forces,
                std::size_t vectors = 1) const;

  /// Visits each block once: two of the body's nodes, and the block.
  template <class Visit>
  void each(const Visit& visit) const {
    for (std::size_t row = 0; row < nodes_.size(); ++row)
      for (std::size_t e = begin_[row]; e < begin_[row + 1]; ++e) {
        const auto column = static_cast<std::size_t>(columns_[e]);
        if (column < row) continue;
        Mat3 block;
        for (Eigen::Index i = 0; i < 3; ++i)
          for (Eigen::Index k = 0; k < 3; ++k)
            block(i, k) = numbers_[9 * e + static_cast<std::size_t>(3 * k + i)];
        visit(nodes_[row], nodes_[column], block);
      }
  }

  std::size_t memory_bytes() const;

 private:
  static void multiply_one(const HoldRows& rows, std::size_t begin, std::size_t end,
                           const double* u, double* forces);
  static void multiply_three(const HoldRows& rows, std::size_t begin, std::size_t end,
                             const double* u, double* forces);
  template <std::size_t kVectors>
  static void multiply_rows(const HoldRows& rows, std::size_t begin, std::size_t end,
                            const double* u, double* forces);

  std::vector<int> nodes_;
  std::vector<std::size_t> begin_{0};  // of each row                                    (n + 1)
  std::vector<int> columns_;           // ascending
  std::vector<float> numbers_;         // of blocks column by column, and one more: each is read
                                       // with the next one's first
};

}  // namespace viscera
