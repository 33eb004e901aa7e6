// How the cells and faces of the gas grid lie in memory.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// n[0] x n[1] x n[2] cells with a layer of ghosts on every side, x fastest. A face has the index
/// of the cell on its upper side, so that faces of all three axes share the cells' indices: the
/// last one of a row is a ghost cell's. Arrays over cells or faces have `count` entries: another
/// layer above, so that what lies next to a face may be read.
struct GasLayout {
  std::array<int, 3> n{};
  std::array<std::ptrdiff_t, 3> stride{};
  std::ptrdiff_t count = 0;

  GasLayout() = default;
  explicit GasLayout(const std::array<int, 3>& cells)
      : n(cells),
        stride{1, cells[0] + 2, std::ptrdiff_t{cells[0] + 2} * (cells[1] + 2)},
        count(stride[2] * (cells[2] + 3)) {}

  /// Of cell (i, j, k), each from -1 to n.
  std::ptrdiff_t index(int i, int j, int k) const {
    return (i + 1) + (j + 1) * stride[1] + (k + 1) * stride[2];
  }
  /// Calls body(first index, length, j, k) for every row of cells of the layers [k_begin, k_end).
  template <class Body>
  void rows(std::size_t k_begin, std::size_t k_end, const Body& body) const {
    for (int k = static_cast<int>(k_begin); k < static_cast<int>(k_end); ++k) {
      for (int j = 0; j < n[1]; ++j) body(index(0, j, k), n[0], j, k);
    }
  }
  template <class Body>
  void rows(const Body& body) const {
    rows(0, static_cast<std::size_t>(n[2]), body);
  }
  /// Number of faces across `axis` along `along`: one more than cells where the two are the same.
  int faces(int axis, int along) const { return n[along] + (axis == along ? 1 : 0); }
};

/// One value a face, an array an axis.
using GasFaces = std::array<std::vector<float>, 3>;

}  // namespace viscera
