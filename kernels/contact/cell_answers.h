// What forces on cells do to a whole body: columns of their own, made once a force acts on them.
// Of organs that touch most cells only might; and those that do stay while others come and go.
#pragma once

#include <span>
#include <vector>

#include "kernels/contact/column_sums.h"

namespace viscera {

/// The places that a cell's load is shared among.
struct CellShares {
  std::vector<int> places;
  std::vector<double> shares;
  bool operator==(const CellShares&) const = default;
};

class CellAnswers {
 public:
  /// From now on of these. Those that share their loads as before keep their columns.
  void follow(std::vector<CellShares> cells);
  /// None: sums go by places.
  bool empty() const { return cells_.empty(); }

  /// Makes what isn't there yet of the columns of these cells, of those of the places.
  void need(std::span<const std::size_t> cells, const ColumnTriples& places);
  /// A column triple of each cell that was needed, by its number(); of others that is below 0.
  ColumnTriples columns() const { return {values_.data(), rows_, rows_}; }
  int number(std::size_t cell) const { return triples_[cell]; }

 private:
  int unused_triple();

  std::vector<CellShares> cells_;
  std::vector<int> triples_;  // of each cell; -1: not made
  std::vector<int> unused_;
  std::size_t rows_ = 0;
  std::vector<float> values_;
};

}  // namespace viscera
