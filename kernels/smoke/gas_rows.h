// Parallel loops over the rows of the gas grid, in pieces that don't depend on the number of
// threads.
#pragma once

#include "kernels/base/parallel.h"
#include "kernels/smoke/gas_layout.h"

namespace viscera {

/// Layers of cells in one piece of work.
inline std::size_t gas_layers_a_chunk(const GasLayout& layout) {
  constexpr std::ptrdiff_t kCells = 6000;
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, kCells / layout.stride[2]));
}

/// Calls body(first index, length, j, k) for every row of cells.
template <class Body>
void for_gas_rows(const GasLayout& layout, const Body& body) {
  parallel_chunks(static_cast<std::size_t>(layout.n[2]), gas_layers_a_chunk(layout),
                  [&](std::size_t begin, std::size_t end) { layout.rows(begin, end, body); });
}

/// Sum of body(first index, length) over every row of cells, in their order.
template <class Body>
double sum_gas_rows(const GasLayout& layout, const Body& body) {
  return parallel_sum(static_cast<std::size_t>(layout.n[2]), gas_layers_a_chunk(layout), 0.0,
                      [&](std::size_t begin, std::size_t end) {
                        double sum = 0.0;
                        layout.rows(begin, end, [&](std::ptrdiff_t c, int length, int, int) {
                          sum += body(c, length);
                        });
                        return sum;
                      });
}

/// Calls body(first index, length, j, k) for every row of faces across `axis`.
template <class Body>
void for_gas_face_rows(const GasLayout& layout, int axis, const Body& body) {
  parallel_chunks(static_cast<std::size_t>(layout.faces(axis, 2)), gas_layers_a_chunk(layout),
                  [&](std::size_t begin, std::size_t end) {
                    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
                      for (int j = 0; j < layout.faces(axis, 1); ++j) {
                        body(layout.index(0, j, k), layout.faces(axis, 0), j, k);
                      }
                    }
                  });
}

}  // namespace viscera
