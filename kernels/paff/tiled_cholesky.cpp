#include "kernels/paff/tiled_cholesky.h"

#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/paff/blas.h"

namespace viscera {
namespace {

constexpr std::size_t kPanel = 192;  // columns eliminated at once
constexpr std::size_t kTile = 512;   // rows and columns of a task

int integer(std::size_t n) {
  return static_cast<int>(n);
}

/// Lower triangle of C (n x n) -= A A^T with A (n x k), tile by tile.
template <class Real>
void subtract_square_in_tiles(std::size_t n, std::size_t k, const Real* a, std::size_t lda, Real* c,
                              std::size_t ldc) {
  const std::size_t tiles = (n + kTile - 1) / kTile;
  parallel_chunks(tiles * (tiles + 1) / 2, 1, [&](std::size_t at, std::size_t) {
    std::size_t row = 0;
    while (at > row) at -= ++row;  // pairs (row, at <= row), row by row
    const std::size_t i = row * kTile, j = at * kTile;
    const std::size_t rows = std::min(kTile, n - i), columns = std::min(kTile, n - j);
    if (i == j) {
      blas::subtract_square(integer(rows), integer(k), a + i, integer(lda), c + i + j * ldc,
                            integer(ldc));
    } else {
      blas::multiply(true, integer(rows), integer(columns), integer(k), Real(-1), a + i,
                     integer(lda), a + j, integer(lda), Real(1), c + i + j * ldc, integer(ldc));
    }
  });
}

}  // namespace

template <class Real>
bool eliminate(std::size_t m, std::size_t k, Real* panel, Real* rest) {
  for (std::size_t first = 0; first < k; first += kPanel) {
    const std::size_t width = std::min(kPanel, k - first), last = first + width;
    Real* corner = panel + first + first * m;
    if (!blas::cholesky(integer(width), corner, integer(m))) return false;
    parallel_chunks(m - last, kTile, [&](std::size_t begin, std::size_t end) {
      blas::solve_right(true, integer(end - begin), integer(width), corner, integer(m),
                        corner + width + begin, integer(m));
    });
    // The rest of the panel: columns up to k, all rows below.
    const std::size_t columns_left = k - last;
    if (columns_left == 0) continue;
    const Real* below = panel + last + first * m;
    Real* right = panel + last + last * m;
    subtract_square_in_tiles(columns_left, width, below, m, right, m);
    const std::size_t rows_below = m - k;
    const std::size_t row_tiles = (rows_below + kTile - 1) / kTile;
    const std::size_t column_tiles = (columns_left + kTile - 1) / kTile;
    parallel_chunks(row_tiles * column_tiles, 1, [&](std::size_t at, std::size_t) {
      const std::size_t i = (at % row_tiles) * kTile, j = (at / row_tiles) * kTile;
      const std::size_t rows = std::min(kTile, rows_below - i);
      const std::size_t columns = std::min(kTile, columns_left - j);
      blas::multiply(true, integer(rows), integer(columns), integer(width), Real(-1),
                     below + columns_left + i, integer(m), below + j, integer(m), Real(1),
                     right + columns_left + i + j * m, integer(m));
    });
  }
  if (m > k) subtract_square_in_tiles(m - k, k, panel + k, m, rest, m - k);
  return true;
}

template bool eliminate(std::size_t, std::size_t, float*, float*);
template bool eliminate(std::size_t, std::size_t, double*, double*);

}  // namespace viscera
