#include "kernels/contact/column_sums.h"

#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

/// Rows that one task sums: they stay in the first-level cache, and a task's share of a column is
/// long enough for the machine to fetch ahead.
constexpr std::size_t kRowChunk = 2048;

/// Three columns and their factors.
struct Triple {
  const float *x, *y, *z;
  float fx, fy, fz;
};

/// u += x fx + y fy + z fz over n rows.
VISCERA_WIDE void add_triple(float* __restrict u, const Triple& t, std::size_t n) {
  const float* __restrict x = t.x, * __restrict y = t.y, * __restrict z = t.z;
  const float fx = t.fx, fy = t.fy, fz = t.fz;
  for (std::size_t i = 0; i < n; ++i) u[i] += x[i] * fx + y[i] * fy + z[i] * fz;
}

/// Two triples at once: half the passes over u, and the sums of two calls of add_triple.
VISCERA_WIDE void add_two_triples(float* __restrict u, const Triple& s, const Triple& t,
                                  std::size_t n) {
  const float* __restrict x = s.x, * __restrict y = s.y, * __restrict z = s.z;
  const float* __restrict p = t.x, * __restrict q = t.y, * __restrict r = t.z;
  const float fx = s.fx, fy = s.fy, fz = s.fz, fp = t.fx, fq = t.fy, fr = t.fz;
  for (std::size_t i = 0; i < n; ++i) {
    const float once = u[i] + (x[i] * fx + y[i] * fy + z[i] * fz);
    u[i] = once + (p[i] * fp + q[i] * fq + r[i] * fr);
  }
}

Triple triple_of(const ColumnTriples& columns, int number, std::size_t first_row,
                 const Vec3f& factors) {
  const float* x =
      columns.values + 3 * static_cast<std::size_t>(number) * columns.stride + first_row;
  return {x, x + columns.stride, x + 2 * columns.stride, factors.x(), factors.y(), factors.z()};
}

}  // namespace

void sum_column_triples(const ColumnTriples& columns, std::span<const int> triples,
                        std::span<const Vec3> loads, std::vector<float>& sums) {
  sums.assign(columns.rows, 0.0f);
  parallel_chunks(columns.rows, kRowChunk, [&](std::size_t begin, std::size_t end) {
    const auto triple = [&](std::size_t j) {
      return triple_of(columns, triples[j], begin, loads[j].cast<float>());
    };
    float* u = sums.data() + begin;
    std::size_t j = 0;
    for (; j + 2 <= triples.size(); j += 2) {
      add_two_triples(u, triple(j), triple(j + 1), end - begin);
    }
    if (j < triples.size()) add_triple(u, triple(j), end - begin);
  });
}

void add_column_triples(const ColumnTriples& columns, std::span<const int> triples,
                        std::span<const Eigen::Matrix3Xf> loads, float* sums) {
  const std::size_t n = columns.rows;
  const auto triple = [&](std::size_t j, std::size_t c) {
    return triple_of(columns, triples[j], 0, loads[c].col(static_cast<Eigen::Index>(j)));
  };
  std::size_t j = 0;
  for (; j + 2 <= triples.size(); j += 2)
    for (std::size_t c = 0; c < loads.size(); ++c)
      add_two_triples(sums + c * n, triple(j, c), triple(j + 1, c), n);
  if (j == triples.size()) return;
  for (std::size_t c = 0; c < loads.size(); ++c) add_triple(sums + c * n, triple(j, c), n);
}

void sum_weighted_triples(const ColumnTriples& columns, std::span<const int> triples,
                          std::span<const double> weights, float* sums) {
  const std::size_t rows = columns.rows;
  std::fill(sums, sums + 3 * rows, 0.0f);
  parallel_chunks(rows, kRowChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = 0; j < triples.size(); j += 3) {
      for (std::size_t a = 0; a < 3; ++a) {
        // One column of each of three nodes; where the last three aren't full, of one node thrice.
        const auto column = [&](std::size_t i) {
          const auto node = static_cast<std::size_t>(triples[i < triples.size() ? i : j]);
          return columns.values + (3 * node + a) * columns.stride + begin;
        };
        const auto weight = [&](std::size_t i) {
          return i < triples.size() ? static_cast<float>(weights[i]) : 0.0f;
        };
        add_triple(sums + a * rows + begin,
                   Triple{column(j), column(j + 1), column(j + 2), weight(j), weight(j + 1),
                          weight(j + 2)},
                   end - begin);
      }
    }
  });
}

}  // namespace viscera
