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

}  // namespace

void sum_column_triples(const float* columns, std::size_t rows, std::span<const int> triples,
                        std::span<const Vec3> loads, std::vector<float>& sums) {
  sums.assign(rows, 0.0f);
  parallel_chunks(rows, kRowChunk, [&](std::size_t begin, std::size_t end) {
    const auto triple = [&](std::size_t j) {
      const float* x = columns + 3 * static_cast<std::size_t>(triples[j]) * rows + begin;
      const Vec3f load = loads[j].cast<float>();
      return Triple{x, x + rows, x + 2 * rows, load.x(), load.y(), load.z()};
    };
    float* u = sums.data() + begin;
    std::size_t j = 0;
    for (; j + 2 <= triples.size(); j += 2) {
      add_two_triples(u, triple(j), triple(j + 1), end - begin);
    }
    if (j < triples.size()) add_triple(u, triple(j), end - begin);
  });
}

void sum_weighted_triples(const float* columns, std::size_t rows, std::span<const int> triples,
                          std::span<const double> weights, float* sums) {
  std::fill(sums, sums + 3 * rows, 0.0f);
  parallel_chunks(rows, kRowChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = 0; j < triples.size(); j += 3) {
      for (std::size_t a = 0; a < 3; ++a) {
        // One column of each of three nodes; where the last three aren't full, of one node thrice.
        const auto column = [&](std::size_t i) {
          const auto node = static_cast<std::size_t>(triples[i < triples.size() ? i : j]);
          return columns + (3 * node + a) * rows + begin;
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
