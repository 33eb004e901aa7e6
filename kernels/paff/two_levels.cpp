#include "kernels/paff/two_levels.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

/// Least distance of coarse nodes, in spacings: leaves every tenth to twelfth.
constexpr double kCoarser = TwoLevels::kCoarser;
/// Radius of a coarse node's fields over that distance.
constexpr double kReach = 1.7;
/// Nodes of a group.
constexpr std::size_t kGroup = 48;
/// Steps of smoothing before and after the coarse correction. With one, a lift's force errs by .5 %
/// in place of .25 % with one iteration a frame; with three by .2 %, for half as much time again.
constexpr int kSmoothings = 2;
/// Eigenvalues down to this share of the greatest are smoothed.
constexpr double kSmoothed = 0.1;

/// to = A x for columns, A symmetric (n x n).
VISCERA_WIDE void multiply_dense(const float* a, std::size_t n, const float* __restrict x,
                                 std::size_t columns, float* __restrict to) {
  std::fill_n(to, n * columns, 0.0f);
  for (std::size_t j = 0; j < n; ++j, a += n) {
    if (columns == 1) {
      const float b = x[j];
#pragma GCC ivdep
      for (std::size_t i = 0; i < n; ++i) to[i] += b * a[i];
      continue;
    }
    for (std::size_t i = 0; i < n; ++i)
#pragma GCC ivdep
      for (std::size_t c = 0; c < columns; ++c) to[i * columns + c] += a[i] * x[j * columns + c];
  }
}

/// to += a x, n numbers.
VISCERA_WIDE void add_scaled(float a, const float* __restrict x, float* __restrict to,
                             std::size_t n) {
#pragma GCC ivdep
  for (std::size_t i = 0; i < n; ++i) to[i] += a * x[i];
}

constexpr std::size_t kChunk = 8192;

template <class Body>
void each_number(std::size_t count, const Body& body) {
  parallel_chunks(count, kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) body(i);
  });
}

/// Of each column.
std::vector<double> products(const std::vector<float>& a, const std::vector<float>& b,
                             std::size_t columns) {
  const std::size_t rows = a.size() / columns, chunks = (rows + 1023) / 1024;
  std::vector<double> parts(chunks * columns, 0.0), sums(columns, 0.0);
  parallel_chunks(rows, 1024, [&](std::size_t first, std::size_t last) {
    double* to = parts.data() + first / 1024 * columns;
    for (std::size_t i = first; i < last; ++i)
      for (std::size_t c = 0; c < columns; ++c)
        to[c] += static_cast<double>(a[i * columns + c]) * static_cast<double>(b[i * columns + c]);
  });
  for (std::size_t p = 0; p < chunks; ++p)
    for (std::size_t c = 0; c < columns; ++c) sums[c] += parts[p * columns + c];
  return sums;
}

/// Halves of a set of nodes across its longest side, until they are small.
void halve(std::span<const Vec3> positions, std::vector<int> nodes, std::vector<int>& grouped,
           std::vector<std::size_t>& begin) {
  if (nodes.size() <= kGroup) {
    std::ranges::sort(nodes);
    grouped.insert(grouped.end(), nodes.begin(), nodes.end());
    begin.push_back(grouped.size());
    return;
  }
  Box box;
  for (const int node : nodes) box.extend(positions[static_cast<std::size_t>(node)]);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto middle = nodes.begin() + static_cast<std::ptrdiff_t>(nodes.size() / 2);
  std::nth_element(nodes.begin(), middle, nodes.end(), [&](int a, int b) {
    const double x = positions[static_cast<std::size_t>(a)][axis],
                 y = positions[static_cast<std::size_t>(b)][axis];
    return x < y || (x == y && a < b);
  });
  halve(positions, std::vector<int>(nodes.begin(), middle), grouped, begin);
  halve(positions, std::vector<int>(middle, nodes.end()), grouped, begin);
}

}  // namespace

/// Every node has a coarse one within its own distance, through tissue: nodes that share no point
/// don't see each other.
std::vector<int> TwoLevels::choose_coarse(std::span<const Vec3> positions,
                                          std::span<const double> spacings) {
  std::vector<char> covered(nodes(), 0);
  std::vector<int> chosen;
  for (std::size_t i = 0; i < nodes(); ++i) {
    if (covered[i]) continue;
    chosen.push_back(static_cast<int>(i));
    for (const int other : stiffness_.row(i)) {
      const auto j = static_cast<std::size_t>(other);
      if ((positions[i] - positions[j]).norm() < kCoarser * spacings[j]) covered[j] = 1;
    }
  }
  return chosen;
}

/// Fields of the coarse nodes at the others, which give constants exactly and linear polynomials
/// but for what keeps flat neighbourhoods regular.
void TwoLevels::prolong_from(std::span<const int> chosen, std::span<const Vec3> positions,
                             std::span<const double> spacings) {
  constexpr double kRegular = 1e-5;
  std::vector<int> number(nodes(), -1);
  for (std::size_t c = 0; c < chosen.size(); ++c)
    number[static_cast<std::size_t>(chosen[c])] = static_cast<int>(c);
  up_begin_.assign(1, 0);
  struct Near {
    int coarse;
    double weight;
    Vec4 p;
  };
  std::vector<Near> near;
  for (std::size_t i = 0; i < nodes(); ++i) {
    near.clear();
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    double sum = 0.0;
    for (const int other : stiffness_.row(i)) {
      const auto j = static_cast<std::size_t>(other);
      if (number[j] < 0) continue;
      const double radius = kReach * kCoarser * std::max(spacings[j], spacings[i]);
      const Vec3 d = (positions[j] - positions[i]) / radius;
      const double s = d.norm();
      if (s >= 1.0) continue;
      const double weight = (1.0 - s) * (1.0 - s) * (1.0 + 2.0 * s);
      const Vec4 p(1.0, d.x(), d.y(), d.z());
      moments += weight * p * p.transpose();
      sum += weight;
      near.push_back({number[j], weight, p});
    }
    moments.diagonal().tail<3>().array() += kRegular * sum;
    const Vec4 first = moments.ldlt().solve(Vec4::Unit(0));
    for (const Near& one : near) {
      up_.push_back(one.coarse);
      up_weights_.push_back(static_cast<float>(one.weight * one.p.dot(first)));
    }
    up_begin_.push_back(up_.size());
  }
  down_begin_.assign(chosen.size() + 1, 0);
  for (const int c : up_) ++down_begin_[static_cast<std::size_t>(c) + 1];
  for (std::size_t c = 0; c < chosen.size(); ++c) down_begin_[c + 1] += down_begin_[c];
  down_.resize(up_.size());
  down_weights_.resize(up_.size());
  std::vector<std::size_t> next(down_begin_.begin(), down_begin_.end() - 1);
  for (std::size_t i = 0; i < nodes(); ++i)
    for (std::size_t e = up_begin_[i]; e < up_begin_[i + 1]; ++e) {
      const std::size_t to = next[static_cast<std::size_t>(up_[e])]++;
      down_[to] = static_cast<int>(i);
      down_weights_[to] = up_weights_[e];
    }
}

/// P^T K P.
SymmetricBlockMatrix TwoLevels::coarse_stiffness(std::size_t coarse) const {
  constexpr std::size_t kRows = 32;
  struct Part {
    std::vector<std::size_t> counts;
    std::vector<int> columns;
    std::vector<double> blocks;
  };
  std::vector<Part> parts((coarse + kRows - 1) / kRows);
  using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using FloatBlock = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  constexpr std::size_t kTerms = RestStiffness::kTerms;
  parallel_chunks(coarse, kRows, [&](std::size_t first, std::size_t last) {
    Part& part = parts[first / kRows];
    std::vector<int> at_node(nodes(), -1), at_coarse(coarse, -1), at_cell(stiffness_.cells(), -1);
    std::vector<int> near_nodes, near_coarse, near_cells;
    std::vector<Block> of_node, of_coarse;
    std::vector<std::array<Vec3, kTerms>> of_cell;
    const auto slot = [](std::vector<int> & at, std::vector<int> & list, auto& values,
                         std::size_t key, const auto& zero) -> auto& {
      if (at[key] < 0) {
        at[key] = static_cast<int>(list.size());
        list.push_back(static_cast<int>(key));
        values.push_back(zero);
      }
      return values[static_cast<std::size_t>(at[key])];
    };
    const Block no_block = Block::Zero();
    std::array<Vec3, kTerms> no_rows;
    no_rows.fill(Vec3::Zero());
    for (std::size_t c = first; c < last; ++c) {
      near_nodes.clear(), near_coarse.clear(), near_cells.clear();
      of_node.clear(), of_coarse.clear(), of_cell.clear();
      // The row of P^T K.
      for (std::size_t d = down_begin_[c]; d < down_begin_[c + 1]; ++d) {
        const auto i = static_cast<std::size_t>(down_[d]);
        const auto weight = static_cast<double>(down_weights_[d]);
        const std::span<const int> row = stiffness_.row(i);
        const float* block = stiffness_.blocks(i);
        for (std::size_t e = 0; e < row.size(); ++e)
          slot(at_node, near_nodes, of_node, static_cast<std::size_t>(row[e]), no_block) +=
              weight * Eigen::Map<const FloatBlock>(block + 9 * e).cast<double>();
        for (const RestStiffness::InCell& in : stiffness_.cells_of(i)) {
          const auto cell = static_cast<std::size_t>(in.cell);
          const auto& g = stiffness_.cell_rows(cell)[in.at];
          auto& sums = slot(at_cell, near_cells, of_cell, cell, no_rows);
          for (std::size_t k = 0; k < kTerms; ++k)
            sums[k] += weight * Eigen::Map<const Vec3f>(g.data() + 3 * k).cast<double>();
        }
      }
      const auto averaged = static_cast<double>(stiffness_.averaged());
      for (const int cell : near_cells) {
        const auto& sums =
            of_cell[static_cast<std::size_t>(at_cell[static_cast<std::size_t>(cell)])];
        const std::span<const int> nodes_of = stiffness_.cell_nodes(static_cast<std::size_t>(cell));
        const auto* rows = stiffness_.cell_rows(static_cast<std::size_t>(cell));
        for (std::size_t e = 0; e < nodes_of.size(); ++e) {
          Block& to =
              slot(at_node, near_nodes, of_node, static_cast<std::size_t>(nodes_of[e]), no_block);
          for (std::size_t k = 0; k < kTerms; ++k)
            to.noalias() +=
                averaged * sums[k] *
                Eigen::Map<const Vec3f>(rows[e].data() + 3 * k).cast<double>().transpose();
        }
      }
      for (const int node : near_nodes) {
        const auto j = static_cast<std::size_t>(node);
        const Block& block = of_node[static_cast<std::size_t>(at_node[j])];
        for (std::size_t e = up_begin_[j]; e < up_begin_[j + 1]; ++e)
          if (static_cast<std::size_t>(up_[e]) >= c)
            slot(at_coarse, near_coarse, of_coarse, static_cast<std::size_t>(up_[e]), no_block) +=
                static_cast<double>(up_weights_[e]) * block;
      }
      std::vector<int> order = near_coarse;
      std::ranges::sort(order);
      for (const int d : order) {
        Block block = of_coarse[static_cast<std::size_t>(at_coarse[static_cast<std::size_t>(d)])];
        if (static_cast<std::size_t>(d) == c) block = (0.5 * (block + block.transpose())).eval();
        part.columns.push_back(d);
        part.blocks.insert(part.blocks.end(), block.data(), block.data() + 9);
      }
      part.counts.push_back(order.size());
      for (const int i : near_nodes) at_node[static_cast<std::size_t>(i)] = -1;
      for (const int i : near_cells) at_cell[static_cast<std::size_t>(i)] = -1;
      for (const int i : near_coarse) at_coarse[static_cast<std::size_t>(i)] = -1;
    }
  });
  SymmetricBlockMatrix matrix;
  matrix.width = 3;
  for (Part& part : parts) {
    for (const std::size_t count : part.counts)
      matrix.pattern.row_begin.push_back(matrix.pattern.row_begin.back() + count);
    matrix.pattern.columns.insert(matrix.pattern.columns.end(), part.columns.begin(),
                                  part.columns.end());
    matrix.blocks.insert(matrix.blocks.end(), part.blocks.begin(), part.blocks.end());
    part = Part();
  }
  return matrix;
}

Result<void> TwoLevels::invert_groups(std::span<const Vec3> positions) {
  std::vector<int> all(nodes());
  std::iota(all.begin(), all.end(), 0);
  halve(positions, std::move(all), grouped_, group_begin_);
  const std::size_t groups = group_begin_.size() - 1;
  rank_.resize(nodes());
  for (std::size_t at = 0; at < grouped_.size(); ++at)
    rank_[static_cast<std::size_t>(grouped_[at])] = static_cast<int>(at);
  for (std::size_t g = 0; g < groups; ++g) {
    const std::size_t n = 3 * (group_begin_[g + 1] - group_begin_[g]);
    inverse_begin_.push_back(inverse_begin_.back() + n * n);
  }
  inverses_.resize(inverse_begin_.back());
  std::vector<char> failed(groups, 0);
  parallel_chunks(groups, 16, [&](std::size_t first, std::size_t last) {
    std::vector<int> place(nodes(), -1), at_cell(stiffness_.cells(), -1);
    std::vector<int> cells;
    for (std::size_t g = first; g < last; ++g) {
      const auto members =
          std::span(grouped_).subspan(group_begin_[g], group_begin_[g + 1] - group_begin_[g]);
      const auto n = static_cast<Eigen::Index>(3 * members.size());
      for (std::size_t m = 0; m < members.size(); ++m)
        place[static_cast<std::size_t>(members[m])] = static_cast<int>(m);
      MatrixX dense = MatrixX::Zero(n, n);
      cells.clear();
      for (std::size_t m = 0; m < members.size(); ++m) {
        const auto i = static_cast<std::size_t>(members[m]);
        const std::span<const int> row = stiffness_.row(i);
        const float* block = stiffness_.blocks(i);
        for (std::size_t e = 0; e < row.size(); ++e)
          if (const int to = place[static_cast<std::size_t>(row[e])]; to >= 0)
            for (int r = 0; r < 3; ++r)
              for (int c = 0; c < 3; ++c)
                dense(3 * static_cast<Eigen::Index>(m) + r, 3 * to + c) =
                    static_cast<double>(block[9 * e + static_cast<std::size_t>(3 * r + c)]);
        for (const RestStiffness::InCell& in : stiffness_.cells_of(i))
          if (int& seen = at_cell[static_cast<std::size_t>(in.cell)]; seen < 0) {
            seen = 0;
            cells.push_back(in.cell);
          }
      }
      MatrixX rows =
          MatrixX::Zero(static_cast<Eigen::Index>(RestStiffness::kTerms * cells.size()), n);
      for (std::size_t c = 0; c < cells.size(); ++c) {
        at_cell[static_cast<std::size_t>(cells[c])] = -1;
        const auto nodes_of = stiffness_.cell_nodes(static_cast<std::size_t>(cells[c]));
        const auto* of = stiffness_.cell_rows(static_cast<std::size_t>(cells[c]));
        for (std::size_t e = 0; e < nodes_of.size(); ++e)
          if (const int to = place[static_cast<std::size_t>(nodes_of[e])]; to >= 0)
            for (std::size_t k = 0; k < RestStiffness::kTerms; ++k)
              for (std::size_t r = 0; r < 3; ++r)
                rows(static_cast<Eigen::Index>(RestStiffness::kTerms * c + k),
                     3 * to + static_cast<int>(r)) = static_cast<double>(of[e][3 * k + r]);
      }
      dense += static_cast<double>(stiffness_.averaged()) * rows.transpose() * rows;
      dense = (0.5 * (dense + dense.transpose())).eval();
      const Eigen::LLT<MatrixX> factor(dense);
      failed[g] = factor.info() != Eigen::Success;
      const MatrixX inverse = factor.solve(MatrixX::Identity(n, n));
      for (Eigen::Index c = 0; c < n; ++c)
        for (Eigen::Index r = 0; r < n; ++r)
          inverses_[inverse_begin_[g] + static_cast<std::size_t>(c * n + r)] =
              static_cast<float>(r <= c ? inverse(r, c) : inverse(c, r));
      for (const int member : members) place[static_cast<std::size_t>(member)] = -1;
    }
  });
  if (std::ranges::find(failed, 1) != failed.end())
    return failure(
        "stiffness: the matrix is singular or not positive definite; expected a body "
        "held firmly and nodes all over it");
  return {};
}

void TwoLevels::apply_groups(const float* r, float* z, std::size_t columns) const {
  parallel_chunks(group_begin_.size() - 1, 16, [&](std::size_t first, std::size_t last) {
    std::vector<float> in, out;
    for (std::size_t g = first; g < last; ++g) {
      const std::size_t members = group_begin_[g + 1] - group_begin_[g], n = 3 * members;
      const int* member = grouped_.data() + group_begin_[g];
      in.resize(n * columns);
      out.resize(n * columns);
      for (std::size_t m = 0; m < members; ++m)
        std::copy_n(r + 3 * columns * static_cast<std::size_t>(member[m]), 3 * columns,
                    in.data() + 3 * columns * m);
      multiply_dense(inverses_.data() + inverse_begin_[g], n, in.data(), columns, out.data());
      for (std::size_t m = 0; m < members; ++m)
        std::copy_n(out.data() + 3 * columns * m, 3 * columns,
                    z + 3 * columns * static_cast<std::size_t>(member[m]));
    }
  });
}

/// The greatest eigenvalue of D^-1 K, by iterations from a load that changes from node to node.
void TwoLevels::bound_smoother() {
  constexpr int kIterations = 12;
  constexpr double kSure = 1.15;
  const std::size_t n = 3 * nodes();
  std::vector<float> x(n), product(n), z(n);
  for (std::size_t i = 0; i < n; ++i)
    x[i] = static_cast<float>(std::sin(1.0 + 12.9898 * static_cast<double>(i)));
  double value = 1.0;
  for (int i = 0; i < kIterations; ++i) {
    stiffness_.multiply(x.data(), product.data(), 1);
    apply_groups(product.data(), z.data(), 1);
    // In the norm of K.
    value = products(z, product, 1)[0] / products(x, product, 1)[0];
    const auto scale = static_cast<float>(1.0 / std::sqrt(products(z, z, 1)[0]));
    each_number(n, [&](std::size_t k) { x[k] = scale * z[k]; });
  }
  greatest_ = kSure * value;
  least_ = kSmoothed * greatest_;
}

void TwoLevels::smooth(std::vector<float>& x, std::vector<float>& r, std::size_t columns,
                       bool keep_residual) const {
  const double middle = 0.5 * (greatest_ + least_), half = 0.5 * (greatest_ - least_);
  std::vector<float> way(r.size()), z(r.size());
  double rho = half / middle;
  apply_groups(r.data(), way.data(), columns);
  const auto first = static_cast<float>(1.0 / middle);
  each_number(r.size(), [&](std::size_t i) {
    way[i] *= first;
    x[i] += way[i];
  });
  for (int step = 1; step <= kSmoothings; ++step) {
    if (step == kSmoothings && !keep_residual) return;
    stiffness_.multiply(way.data(), z.data(), columns);
    each_number(r.size(), [&](std::size_t i) { r[i] -= z[i]; });
    if (step == kSmoothings) return;
    const double next = 1.0 / (2.0 * middle / half - rho);
    apply_groups(r.data(), z.data(), columns);
    const auto kept = static_cast<float>(next * rho), added = static_cast<float>(2.0 * next / half);
    rho = next;
    each_number(r.size(), [&](std::size_t i) {
      way[i] = kept * way[i] + added * z[i];
      x[i] += way[i];
    });
  }
}

void TwoLevels::correct(std::vector<float>& x, std::vector<float>& r, std::size_t columns) const {
  const std::size_t coarse = coarse_nodes();
  std::vector<float> block(3 * coarse * columns, 0.0f);
  parallel_chunks(coarse, 64, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c)
      for (std::size_t e = down_begin_[c]; e < down_begin_[c + 1]; ++e)
        add_scaled(down_weights_[e], r.data() + 3 * columns * static_cast<std::size_t>(down_[e]),
                   block.data() + 3 * columns * c, 3 * columns);
  });
  if (columns == 1) {
    std::vector<double> b(block.begin(), block.end()), answer(b.size());
    compact_->apply(b, answer);
    std::ranges::transform(answer, block.begin(), [](double a) { return static_cast<float>(a); });
  } else {
    coarse_->apply(block, static_cast<int>(columns));
  }
  std::vector<float> way(r.size(), 0.0f), product(r.size());
  parallel_chunks(nodes(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      for (std::size_t e = up_begin_[i]; e < up_begin_[i + 1]; ++e)
        add_scaled(up_weights_[e], block.data() + 3 * columns * static_cast<std::size_t>(up_[e]),
                   way.data() + 3 * columns * i, 3 * columns);
  });
  stiffness_.multiply(way.data(), product.data(), columns);
  each_number(r.size(), [&](std::size_t i) {
    x[i] += way[i];
    r[i] -= product[i];
  });
}

void TwoLevels::apply(std::vector<float>& columns, std::size_t count) const {
  std::vector<float> x(columns.size(), 0.0f);
  smooth(x, columns, count, true);
  correct(x, columns, count);
  smooth(x, columns, count, false);
  columns.swap(x);
}

void TwoLevels::apply(std::span<const double> b, std::span<double> x) const {
  double size = 0.0;
  for (const double value : b) size = std::max(size, std::abs(value));
  // Single precision holds numbers of 1e-38 to 1e38 only; loads may be far from 1.
  const double scale = size > 0.0 ? 1.0 / size : 1.0;
  std::vector<float> column(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) column[i] = static_cast<float>(scale * b[i]);
  apply(column, 1);
  for (std::size_t i = 0; i < b.size(); ++i) x[i] = static_cast<double>(column[i]) / scale;
}

/// Conjugate gradients, each column by itself.
void TwoLevels::solve(std::vector<float>& columns, std::size_t count) const {
  constexpr int kMostSteps = 60;
  const std::size_t n = columns.size();
  std::vector<float> x(n, 0.0f), z, way(n, 0.0f), product(n);
  std::vector<float>& r = columns;
  std::vector<double> begun, rho(count, 0.0);
  std::vector<float> kept(count), length(count);
  for (int step = 0; step < kMostSteps; ++step) {
    z = r;
    apply(z, count);
    const std::vector<double> next = products(r, z, count);
    if (step == 0) begun = next;
    bool goes_on = false;
    for (std::size_t c = 0; c < count; ++c) {
      const bool on = next[c] > kSolved * begun[c];
      goes_on = goes_on || on;
      kept[c] = step > 0 && rho[c] > 0.0 && on ? static_cast<float>(next[c] / rho[c]) : 0.0f;
      rho[c] = on ? next[c] : 0.0;
    }
    if (!goes_on) break;
    each_number(n, [&](std::size_t i) { way[i] = z[i] + kept[i % count] * way[i]; });
    stiffness_.multiply(way.data(), product.data(), count);
    const std::vector<double> curvature = products(way, product, count);
    for (std::size_t c = 0; c < count; ++c)
      length[c] =
          rho[c] > 0.0 && curvature[c] > 0.0 ? static_cast<float>(rho[c] / curvature[c]) : 0.0f;
    each_number(n, [&](std::size_t i) {
      x[i] += length[i % count] * way[i];
      r[i] -= length[i % count] * product[i];
    });
  }
  columns.swap(x);
}

Result<TwoLevels> TwoLevels::make(RestStiffness stiffness, std::span<const Vec3> positions,
                                  std::span<const double> spacings,
                                  std::shared_ptr<const StiffnessFactor> coarse) {
  TwoLevels levels(std::move(stiffness));
  const std::vector<int> chosen = levels.choose_coarse(positions, spacings);
  levels.prolong_from(chosen, positions, spacings);
  if (!coarse) {
    std::vector<Vec3> places;
    for (const int node : chosen) places.push_back(positions[static_cast<std::size_t>(node)]);
    const SymmetricBlockMatrix matrix = levels.coarse_stiffness(chosen.size());
    auto factor = StiffnessFactor::factor(matrix, places, FactorPrecision::kSingle);
    if (!factor) factor = StiffnessFactor::factor(matrix, places, FactorPrecision::kFull);
    if (!factor) return std::unexpected(factor.error());
    coarse = std::make_shared<const StiffnessFactor>(std::move(*factor));
  }
  if (coarse->nodes() != chosen.size())
    return failure("factor: found one of " + std::to_string(coarse->nodes()) + " nodes, expected " +
                   std::to_string(chosen.size()));
  levels.coarse_ = std::move(coarse);
  levels.compact_ = std::make_unique<const CompactFactor>(levels.coarse_->pack());
  if (auto inverted = levels.invert_groups(positions); !inverted)
    return std::unexpected(inverted.error());
  levels.bound_smoother();
  return levels;
}

std::size_t TwoLevels::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return stiffness_.memory_bytes() + of(up_begin_) + of(down_begin_) + of(up_) + of(down_) +
         of(up_weights_) + of(down_weights_) + coarse_->factor_bytes() + compact_->memory_bytes() +
         of(group_begin_) + of(inverse_begin_) + of(grouped_) + of(rank_) + of(inverses_);
}

namespace {

/// In blocks of so many touchable places near each other.
constexpr std::size_t kPlacesAtOnce = 8;

class LevelColumns final : public ColumnSource {
 public:
  LevelColumns(std::shared_ptr<const TwoLevels> levels, TwoLevels::Columns kind,
               const SparseWeights& places, std::size_t touchable)
      : levels_(std::move(levels)), kind_(kind), places_(places), block_of_(touchable, 0) {
    std::vector<int> order(touchable), first(touchable);
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t t = 0; t < touchable; ++t)
      first[t] = levels_->rank(places_.nodes[static_cast<std::size_t>(places_.row_begin[t])]);
    std::ranges::sort(order, [&](int a, int b) {
      const int of_a = first[static_cast<std::size_t>(a)],
                of_b = first[static_cast<std::size_t>(b)];
      return of_a != of_b ? of_a < of_b : a < b;
    });
    for (std::size_t t = 0; t < touchable; ++t) {
      if (t % kPlacesAtOnce == 0) blocks_.emplace_back();
      blocks_.back().push_back(order[t]);
      block_of_[static_cast<std::size_t>(order[t])] = blocks_.size() - 1;
    }
  }

  std::size_t blocks() const override { return blocks_.size(); }
  std::size_t block_of(int touchable) const override {
    return block_of_[static_cast<std::size_t>(touchable)];
  }
  void make(std::size_t index, float* to) const override {
    const std::vector<int>& block = blocks_[index];
    const std::size_t columns = 3 * block.size(), rows = 3 * places_.rows();
    std::vector<float> solved(3 * levels_->nodes() * columns, 0.0f);
    const auto each_entry = [&](std::size_t place, const auto& visit) {
      for (int e = places_.row_begin[place]; e < places_.row_begin[place + 1]; ++e)
        visit(static_cast<std::size_t>(places_.nodes[static_cast<std::size_t>(e)]),
              static_cast<float>(places_.values[static_cast<std::size_t>(e)]));
    };
    for (std::size_t b = 0; b < block.size(); ++b)
      each_entry(static_cast<std::size_t>(block[b]), [&](std::size_t node, float value) {
        for (std::size_t k = 0; k < 3; ++k) solved[(3 * node + k) * columns + 3 * b + k] += value;
      });
    if (kind_ == TwoLevels::Columns::kCycle)
      levels_->apply(solved, columns);
    else
      levels_->solve(solved, columns);
    parallel_for_each_index(places_.rows(), 256, [&](std::size_t place) {
      std::vector<float> sums(3 * columns, 0.0f);
      each_entry(place, [&](std::size_t node, float value) {
        add_scaled(value, solved.data() + 3 * node * columns, sums.data(), 3 * columns);
      });
      for (std::size_t c = 0; c < columns; ++c) {
        const std::size_t column = 3 * static_cast<std::size_t>(block[c / 3]) + c % 3;
        for (std::size_t k = 0; k < 3; ++k)
          to[column * rows + 3 * place + k] = sums[k * columns + c];
      }
    });
  }
  std::size_t memory_bytes() const override { return levels_->memory_bytes(); }

 private:
  std::shared_ptr<const TwoLevels> levels_;
  TwoLevels::Columns kind_;
  SparseWeights places_;
  std::vector<std::vector<int>> blocks_;
  std::vector<std::size_t> block_of_;
};

}  // namespace

std::shared_ptr<const ColumnSource> TwoLevels::columns(std::shared_ptr<const TwoLevels> levels,
                                                       Columns kind, const SparseWeights& places,
                                                       std::size_t touchable) {
  return std::make_shared<LevelColumns>(std::move(levels), kind, places, touchable);
}

}  // namespace viscera
