#include "kernels/contact/cell_answers.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "kernels/base/parallel.h"

namespace viscera {

void CellAnswers::follow(std::vector<CellShares> cells) {
  const std::vector<CellShares> before = std::exchange(cells_, std::move(cells));
  std::vector<int> left = std::exchange(triples_, std::vector<int>(cells_.size(), -1));
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const auto known = std::ranges::find(before, cells_[k]);
    if (known == before.end()) continue;
    triples_[k] = std::exchange(left[static_cast<std::size_t>(known - before.begin())], -1);
  }
  std::ranges::copy_if(left, std::back_inserter(unused_), [](int triple) { return triple >= 0; });
}

void CellAnswers::need(std::span<const std::size_t> cells, const ColumnTriples& places) {
  rows_ = places.rows;
  std::vector<std::size_t> missing;
  for (const std::size_t cell : cells) {
    if (triples_[cell] >= 0) continue;
    triples_[cell] = unused_triple();
    missing.push_back(cell);
  }
  parallel_for_each_index(missing.size(), 1, [&](std::size_t i) {
    const std::size_t cell = missing[i];
    sum_weighted_triples(places, cells_[cell].places, cells_[cell].shares,
                         values_.data() + 3 * rows_ * static_cast<std::size_t>(triples_[cell]));
  });
}

int CellAnswers::unused_triple() {
  if (unused_.empty()) {
    const std::size_t count = values_.size() / (3 * rows_);
    values_.resize(3 * rows_ * (count + 1));
    return static_cast<int>(count);
  }
  const int triple = unused_.back();
  unused_.pop_back();
  return triple;
}

}  // namespace viscera
