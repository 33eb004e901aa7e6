#include "kernels/smoke/gas_pressure.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "kernels/base/wide.h"
#include "kernels/smoke/gas_rows.h"

namespace viscera {

namespace {

// Two steps of Richardson's iteration on A scaled by its diagonal, at the Chebyshev nodes of the
// eigenvalues that a coarse grid can't see: from 1/3 (a wave along one axis) to 2.
constexpr float kRelax[2] = {0.5695f, 1.7316f};

// The weights that a row of A takes, and where its neighbours lie.
struct Stencil {
  const float *diagonal, *x, *y, *z;
  std::ptrdiff_t row, layer;
};

// What the neighbours of cell c add up to.
inline float around(const Stencil& s, const float* in, std::ptrdiff_t c) {
  return (s.x[c] * in[c - 1] + s.x[c + 1] * in[c + 1]) +
         (s.y[c] * in[c - s.row] + s.y[c + s.row] * in[c + s.row]) +
         (s.z[c] * in[c - s.layer] + s.z[c + s.layer] * in[c + s.layer]);
}

// One row of cells: out = A in.
VISCERA_WIDE void apply_row(const Stencil& s, const float* __restrict in, float* __restrict out,
                            std::ptrdiff_t c, int length) {
  const Stencil local = s;
  for (std::ptrdiff_t i = c; i < c + length; ++i) {
    out[i] = local.diagonal[i] * in[i] - around(local, in, i);
  }
}

// One row of cells: out = in + relax D^-1 (b - A in).
VISCERA_WIDE void relax_row(const Stencil& s, const float* __restrict inverse,
                            const float* __restrict b, const float* __restrict in,
                            float* __restrict out, float relax, std::ptrdiff_t c, int length) {
  const Stencil local = s;
  for (std::ptrdiff_t i = c; i < c + length; ++i) {
    const float product = local.diagonal[i] * in[i] - around(local, in, i);
    out[i] = in[i] + relax * inverse[i] * (b[i] - product);
  }
}

// Eight partial sums, so that the compiler may use wide registers without reordering.
VISCERA_WIDE double dot_row(const float* __restrict a, const float* __restrict b, int length) {
  double part[8] = {};
  int i = 0;
  for (; i + 8 <= length; i += 8) {
    for (int l = 0; l < 8; ++l) {
      part[l] += static_cast<double>(a[i + l]) * static_cast<double>(b[i + l]);
    }
  }
  for (; i < length; ++i) part[0] += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]));
}

VISCERA_WIDE void add_row(float* __restrict y, float factor, const float* __restrict x,
                          int length) {
  for (int i = 0; i < length; ++i) y[i] += factor * x[i];
}

VISCERA_WIDE void scale_add_row(float* __restrict p, float factor, const float* __restrict z,
                                int length) {
  for (int i = 0; i < length; ++i) p[i] = z[i] + factor * p[i];
}

template <class Level>
Stencil stencil(const Level& level) {
  return {level.diagonal.data(), level.face[0].data(),   level.face[1].data(),
          level.face[2].data(),  level.layout.stride[1], level.layout.stride[2]};
}

// Cells of the finer grid that coarse cell `i` joins along an axis with `n` fine cells of which
// `coarse` are made: [first, last).
struct Joined {
  int first, last;
};

Joined joined(int i, int n, int coarse) {
  if (n == coarse) return {i, i + 1};
  return {2 * i, std::min(2 * i + 2, n)};
}

}  // namespace

GasPressure::GasPressure(const std::array<int, 3>& cells) {
  std::array<int, 3> n = cells;
  while (true) {
    Level& level = levels_.emplace_back();
    level.layout = GasLayout(n);
    const auto count = static_cast<std::size_t>(level.layout.count);
    for (auto* values : {&level.face[0], &level.face[1], &level.face[2], &level.diagonal,
                         &level.inverse, &level.x, &level.y, &level.b}) {
      values->assign(count, 0.0f);
    }
    if (*std::ranges::max_element(n) <= 2) break;
    for (int& m : n) m = (m + 1) / 2;
  }
  p_.assign(static_cast<std::size_t>(layout().count), 0.0f);
  q_ = p_;
}

void GasPressure::set_openings(const GasFaces& faces) {
  Level& finest = levels_.front();
  finest.face = faces;
  for (std::size_t l = 1; l < levels_.size(); ++l) coarsen(levels_[l - 1], levels_[l]);
  for (Level& level : levels_) {
    const auto& stride = level.layout.stride;
    for_gas_rows(level.layout, [&](std::ptrdiff_t c, int length, int, int) {
      for (std::ptrdiff_t i = c; i < c + length; ++i) {
        float sum = 0.0f;
        for (int axis = 0; axis < 3; ++axis) {
          const float* w = level.face[axis].data() + i;
          sum += w[0] + w[stride[axis]];
        }
        level.diagonal[static_cast<std::size_t>(i)] = sum;
        level.inverse[static_cast<std::size_t>(i)] = sum > 0.0f ? 1.0f / sum : 0.0f;
      }
    });
  }

  const Level& last = levels_.back();
  const GasLayout& layout = last.layout;
  const int unknowns = layout.n[0] * layout.n[1] * layout.n[2];
  MatrixX dense = MatrixX::Zero(unknowns, unknowns);
  const auto number = [&](int i, int j, int k) { return i + layout.n[0] * (j + layout.n[1] * k); };
  layout.rows([&](std::ptrdiff_t c, int length, int j, int k) {
    for (int i = 0; i < length; ++i) {
      const std::ptrdiff_t at = c + i;
      const int row = number(i, j, k);
      dense(row, row) = last.diagonal[static_cast<std::size_t>(at)];
      const auto couple = [&](int axis, int other) {
        const double w = last.face[axis][static_cast<std::size_t>(at)];
        dense(row, other) -= w;
        dense(other, row) -= w;
      };
      if (i > 0) couple(0, number(i - 1, j, k));
      if (j > 0) couple(1, number(i, j - 1, k));
      if (k > 0) couple(2, number(i, j, k - 1));
    }
  });
  const Eigen::SelfAdjointEigenSolver<MatrixX> eigen(dense);
  const double least = 1e-5 * std::max(eigen.eigenvalues().maxCoeff(), 1e-300);
  const VectorX inverse =
      eigen.eigenvalues().unaryExpr([&](double v) { return v > least ? 1.0 / v : 0.0; });
  coarsest_ = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

void GasPressure::coarsen(const Level& fine, Level& coarse) const {
  const auto& n = fine.layout.n;
  const auto& m = coarse.layout.n;
  const auto joined_cells = [&](int axis, int i) { return joined(i, n[axis], m[axis]); };
  for (int k = 0; k <= m[2]; ++k) {
    for (int j = 0; j <= m[1]; ++j) {
      for (int i = 0; i <= m[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        const auto c = static_cast<std::size_t>(coarse.layout.index(i, j, k));
        for (int axis = 0; axis < 3; ++axis) {
          const int b = (axis + 1) % 3, d = (axis + 2) % 3;
          if (at[b] == m[b] || at[d] == m[d]) continue;
          std::array<int, 3> f{};
          f[axis] = at[axis] == m[axis] ? n[axis] : joined_cells(axis, at[axis]).first;
          const Joined across = joined_cells(b, at[b]), along = joined_cells(d, at[d]);
          float sum = 0.0f;
          for (f[b] = across.first; f[b] < across.last; ++f[b]) {
            for (f[d] = along.first; f[d] < along.last; ++f[d]) {
              sum += fine.face[axis][static_cast<std::size_t>(fine.layout.index(f[0], f[1], f[2]))];
            }
          }
          coarse.face[axis][c] = n[axis] == m[axis] ? sum : 0.5f * sum;
        }
      }
    }
  }
}

void GasPressure::apply(std::span<const float> x, std::span<float> y) const {
  const Stencil s = stencil(levels_.front());
  for_gas_rows(layout(), [&](std::ptrdiff_t c, int length, int, int) {
    apply_row(s, x.data(), y.data(), c, length);
  });
}

void GasPressure::cycle(std::size_t l) {
  Level& level = levels_[l];
  const GasLayout& layout = level.layout;
  if (l + 1 == levels_.size()) {
    VectorX b(coarsest_.rows());
    Eigen::Index row = 0;
    layout.rows([&](std::ptrdiff_t c, int length, int, int) {
      for (int i = 0; i < length; ++i) b[row++] = level.b[static_cast<std::size_t>(c + i)];
    });
    const VectorX x = coarsest_ * b;
    row = 0;
    layout.rows([&](std::ptrdiff_t c, int length, int, int) {
      for (int i = 0; i < length; ++i) {
        level.x[static_cast<std::size_t>(c + i)] = static_cast<float>(x[row++]);
      }
    });
    return;
  }
  const Stencil s = stencil(level);
  float *x = level.x.data(), *y = level.y.data();
  const float *b = level.b.data(), *inverse = level.inverse.data();
  // From x = 0 the first step needs no neighbours.
  for_gas_rows(layout, [&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i) y[i] = kRelax[0] * inverse[i] * b[i];
  });
  for_gas_rows(layout, [&](std::ptrdiff_t c, int length, int, int) {
    relax_row(s, inverse, b, y, x, kRelax[1], c, length);
  });
  // Two chunks may not write one coarse row: chunks go by coarse layers.
  Level& coarse = levels_[l + 1];
  const auto& n = layout.n;
  const auto& m = coarse.layout.n;
  parallel_chunks(
      static_cast<std::size_t>(m[2]), std::max<std::size_t>(1, gas_layers_a_chunk(layout) / 2),
      [&](std::size_t first, std::size_t last) {
        for (int k = static_cast<int>(first); k < static_cast<int>(last); ++k) {
          const Joined z = joined(k, n[2], m[2]);
          for (int j = 0; j < m[1]; ++j) {
            const Joined row = joined(j, n[1], m[1]);
            float* target = coarse.b.data() + coarse.layout.index(0, j, k);
            std::fill(target, target + m[0], 0.0f);
            for (int fk = z.first; fk < z.last; ++fk) {
              for (int fj = row.first; fj < row.last; ++fj) {
                const std::ptrdiff_t c = layout.index(0, fj, fk);
                apply_row(s, x, y, c, n[0]);
                const float *product = y + c, *given = b + c;
                if (n[0] == m[0]) {
                  for (int i = 0; i < n[0]; ++i) target[i] += given[i] - product[i];
                } else {
                  for (int i = 0; i + 1 < n[0]; i += 2) {
                    target[i / 2] += (given[i] - product[i]) + (given[i + 1] - product[i + 1]);
                  }
                  if (n[0] % 2 == 1) target[n[0] / 2] += given[n[0] - 1] - product[n[0] - 1];
                }
              }
            }
          }
        }
      });
  cycle(l + 1);
  const float* correction = coarse.x.data();
  for_gas_rows(layout, [&](std::ptrdiff_t c, int length, int j, int k) {
    const float* from =
        correction + coarse.layout.index(0, n[1] == m[1] ? j : j / 2, n[2] == m[2] ? k : k / 2);
    // Cells outside the gas take no correction.
    if (n[0] == m[0]) {
      for (int i = 0; i < length; ++i) x[c + i] += inverse[c + i] > 0.0f ? from[i] : 0.0f;
    } else {
      for (int i = 0; i < length; ++i) x[c + i] += inverse[c + i] > 0.0f ? from[i / 2] : 0.0f;
    }
  });
  for_gas_rows(layout, [&](std::ptrdiff_t c, int length, int, int) {
    relax_row(s, inverse, b, x, y, kRelax[0], c, length);
  });
  for_gas_rows(layout, [&](std::ptrdiff_t c, int length, int, int) {
    relax_row(s, inverse, b, y, x, kRelax[1], c, length);
  });
}

void GasPressure::precondition(std::span<const float> r, std::span<float> z) {
  Level& finest = levels_.front();
  for_gas_rows(layout(), [&](std::ptrdiff_t c, int length, int, int) {
    std::copy_n(r.data() + c, length, finest.b.data() + c);
  });
  cycle(0);
  for_gas_rows(layout(), [&](std::ptrdiff_t c, int length, int, int) {
    std::copy_n(finest.x.data() + c, length, z.data() + c);
  });
}

GasPressure::Outcome GasPressure::solve(std::span<const float> b, std::span<float> x,
                                        double tolerance, int most) {
  Level& finest = levels_.front();
  const GasLayout& grid = layout();
  const Stencil s = stencil(finest);
  // The cycle works on r in place, so that it needs no copies.
  float *r = finest.b.data(), *z = finest.x.data(), *p = p_.data(), *q = q_.data();
  const auto dot = [&](const float* a, const float* c) {
    return sum_gas_rows(
        grid, [&](std::ptrdiff_t at, int length) { return dot_row(a + at, c + at, length); });
  };
  Outcome outcome;
  const double given = dot(b.data(), b.data());
  double square = sum_gas_rows(grid, [&](std::ptrdiff_t c, int length) {
    apply_row(s, x.data(), q, c, length);
    for (std::ptrdiff_t i = c; i < c + length; ++i) {
      r[i] = finest.inverse[static_cast<std::size_t>(i)] > 0.0f
                 ? b[static_cast<std::size_t>(i)] - q[i]
                 : 0.0f;
    }
    return dot_row(r + c, r + c, length);
  });
  if (!(square <= given)) {  // the guess is worse than none
    std::ranges::fill(x, 0.0f);
    square = sum_gas_rows(grid, [&](std::ptrdiff_t c, int length) {
      for (std::ptrdiff_t i = c; i < c + length; ++i) {
        r[i] = finest.inverse[static_cast<std::size_t>(i)] > 0.0f ? b[static_cast<std::size_t>(i)]
                                                                  : 0.0f;
      }
      return dot_row(r + c, r + c, length);
    });
  }
  std::ranges::fill(p_, 0.0f);
  double product = 0.0;
  while (true) {
    outcome.residual = std::sqrt(square);
    outcome.converged = outcome.residual <= tolerance;
    if (outcome.converged || outcome.iterations == most || !std::isfinite(square)) return outcome;
    cycle(0);
    const double next = dot(r, z);
    // Rounding has eaten the residual: nothing more to be had.
    if (!(next > 0.0)) return outcome;
    const float beta = product > 0.0 ? static_cast<float>(next / product) : 0.0f;
    product = next;
    for_gas_rows(grid, [&](std::ptrdiff_t c, int length, int, int) {
      scale_add_row(p + c, beta, z + c, length);
    });
    const double curvature = sum_gas_rows(grid, [&](std::ptrdiff_t c, int length) {
      apply_row(s, p, q, c, length);
      return dot_row(p + c, q + c, length);
    });
    if (!(curvature > 0.0)) return outcome;
    const auto alpha = static_cast<float>(product / curvature);
    square = sum_gas_rows(grid, [&](std::ptrdiff_t c, int length) {
      add_row(x.data() + c, alpha, p + c, length);
      add_row(r + c, -alpha, q + c, length);
      return dot_row(r + c, r + c, length);
    });
    ++outcome.iterations;
  }
}

}  // namespace viscera
