// The stiffness of a body at rest as a matrix to multiply by: of large bodies, whose assembled
// stiffness with averaged dilatation nobody factors.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "kernels/paff/block_matrix.h"
#include "kernels/paff/elastic_region.h"

namespace viscera {

/// What a step adds to the body at rest.
struct RestTerms {
  double shear = 1.0;               ///< the shear modulus, but that of the hold, so many times
  double stiff = 1.0;               ///< all of it so many times
  std::span<const double> inertia;  ///< of the nodes [N/m]; empty: none                     (N)
};

/// K = P + averaged sum_ck G_ck^T G_ck: what is pointwise as whole rows of blocks, what acts on
/// averaged dilatation as the rows G of its cells, both in single precision. The cells' products
/// would treble the blocks. Immutable; safe from many threads at once.
class RestStiffness {
 public:
  static constexpr std::size_t kTerms = ElasticRegion::kTerms;
  using Gradients = std::array<float, 3 * kTerms>;  ///< G of a node: x, y, z of each term

  /// `region`: all points of a body of `nodes` nodes. `hold`: what its hold adds.
  static RestStiffness assemble(std::size_t nodes, const ElasticRegion& region,
                                const SymmetricBlockMatrix& hold, const RestTerms& terms);

  /// y = K x for columns of 3 N numbers, stored row by row (3 N x columns). The same bits for any
  /// number of threads.
  void multiply(const float* x, float* y, std::size_t columns) const;

  std::size_t nodes() const { return row_begin_.size() - 1; }
  std::size_t memory_bytes() const;

  /// Nodes whose fields meet a node's, ascending, itself among them, and blocks of 3 x 3,
  /// row-major.
  std::span<const int> row(std::size_t node) const {
    return {columns_.data() + row_begin_[node], row_begin_[node + 1] - row_begin_[node]};
  }
  const float* blocks(std::size_t node) const { return blocks_.data() + 9 * row_begin_[node]; }

  /// Of a cell of averaged dilatation.
  std::span<const int> cell_nodes(std::size_t cell) const {
    return {cell_nodes_.data() + cell_begin_[cell], cell_begin_[cell + 1] - cell_begin_[cell]};
  }
  const Gradients* cell_rows(std::size_t cell) const { return rows_.data() + cell_begin_[cell]; }
  std::size_t cells() const { return cell_begin_.size() - 1; }
  /// The cells that reach a node, and where it stands in them.
  struct InCell {
    int cell, at;
  };
  std::span<const InCell> cells_of(std::size_t node) const {
    return {in_cells_.data() + in_begin_[node], in_begin_[node + 1] - in_begin_[node]};
  }
  float averaged() const { return averaged_; }

 private:
  RestStiffness() = default;
  void gather_cells(std::size_t nodes, const ElasticRegion& region);

  std::vector<std::size_t> row_begin_{0};
  std::vector<int> columns_;
  std::vector<float> blocks_;
  float averaged_ = 0.0f;
  std::vector<std::size_t> cell_begin_{0};
  std::vector<int> cell_nodes_;
  std::vector<Gradients> rows_;
  std::vector<std::size_t> in_begin_{0};
  std::vector<InCell> in_cells_;
};

}  // namespace viscera
