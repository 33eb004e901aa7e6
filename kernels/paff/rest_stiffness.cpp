#include "kernels/paff/rest_stiffness.h"

#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr std::size_t kTerms = RestStiffness::kTerms;

/// to += a row of blocks times x, of so many columns.
VISCERA_WIDE void add_blocks(const float* block, std::span<const int> nodes, const float* x,
                             std::size_t columns, float* __restrict to) {
  if (columns == 1) {
    float a = 0.0f, b = 0.0f, c = 0.0f;
    for (std::size_t e = 0; e < nodes.size(); ++e, block += 9) {
      const float* from = x + 3 * static_cast<std::size_t>(nodes[e]);
      a += block[0] * from[0] + block[1] * from[1] + block[2] * from[2];
      b += block[3] * from[0] + block[4] * from[1] + block[5] * from[2];
      c += block[6] * from[0] + block[7] * from[1] + block[8] * from[2];
    }
    to[0] += a, to[1] += b, to[2] += c;
    return;
  }
  for (std::size_t e = 0; e < nodes.size(); ++e, block += 9) {
    const float* from = x + 3 * columns * static_cast<std::size_t>(nodes[e]);
    for (std::size_t r = 0; r < 3; ++r) {
      const float a = block[3 * r], b = block[3 * r + 1], c = block[3 * r + 2];
      float* __restrict sum = to + r * columns;
#pragma GCC ivdep
      for (std::size_t i = 0; i < columns; ++i)
        sum[i] += a * from[i] + b * from[columns + i] + c * from[2 * columns + i];
    }
  }
}

/// to += G^T theta of a node in a cell.
VISCERA_WIDE void add_gradients(const float* g, const float* theta, std::size_t columns,
                                float* __restrict to) {
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < kTerms; ++k)
#pragma GCC ivdep
      for (std::size_t i = 0; i < columns; ++i)
        to[r * columns + i] += g[3 * k + r] * theta[k * columns + i];
}

/// theta += G x.
VISCERA_WIDE void add_dilatation(const float* g, const float* x, std::size_t columns,
                                 float* __restrict theta) {
  for (std::size_t k = 0; k < kTerms; ++k)
    for (std::size_t r = 0; r < 3; ++r)
#pragma GCC ivdep
      for (std::size_t i = 0; i < columns; ++i)
        theta[k * columns + i] += g[3 * k + r] * x[r * columns + i];
}

/// Both triangles of the pattern.
void whole_rows(const SymmetricPattern& upper, std::vector<std::size_t>& begin,
                std::vector<int>& columns) {
  const std::size_t n = upper.rows();
  begin.assign(n + 1, 0);
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t e = upper.row_begin[row]; e < upper.row_begin[row + 1]; ++e) {
      const auto column = static_cast<std::size_t>(upper.columns[e]);
      ++begin[row + 1];
      if (column != row) ++begin[column + 1];
    }
  for (std::size_t row = 0; row < n; ++row) begin[row + 1] += begin[row];
  columns.resize(begin.back());
  // Earlier columns of a row first: they come from rows before it.
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t e = upper.row_begin[row] + 1; e < upper.row_begin[row + 1]; ++e)
      columns[next[static_cast<std::size_t>(upper.columns[e])]++] = static_cast<int>(row);
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t e = upper.row_begin[row]; e < upper.row_begin[row + 1]; ++e)
      columns[next[row]++] = upper.columns[e];
}

/// Each block that isn't zero as a point that its two nodes share.
PointFields pairs_of(const SymmetricBlockMatrix& matrix) {
  PointFields pairs;
  for (std::size_t row = 0; row < matrix.pattern.rows(); ++row)
    for (std::size_t e = matrix.pattern.row_begin[row]; e < matrix.pattern.row_begin[row + 1];
         ++e) {
      const double* block = matrix.blocks.data() + 9 * e;
      if (std::all_of(block, block + 9, [](double b) { return b == 0.0; })) continue;
      pairs.nodes.push_back(static_cast<int>(row));
      if (matrix.pattern.columns[e] != static_cast<int>(row))
        pairs.nodes.push_back(matrix.pattern.columns[e]);
      pairs.begin.push_back(pairs.nodes.size());
    }
  return pairs;
}

}  // namespace

void RestStiffness::gather_cells(std::size_t nodes, const ElasticRegion& region) {
  in_begin_.assign(nodes + 1, 0);
  if (region.cell.empty() || !(region.averaged_lambda > 0.0)) return;
  const auto cells =
      static_cast<std::size_t>(*std::max_element(region.cell.begin(), region.cell.end())) + 1;
  std::vector<std::vector<std::size_t>> points_of(cells);
  for (std::size_t q = 0; q < region.size(); ++q)
    points_of[static_cast<std::size_t>(region.cell[q])].push_back(q);
  struct Part {
    std::vector<int> nodes;
    std::vector<Gradients> rows;
  };
  std::vector<Part> parts(cells);
  parallel_chunks(cells, 64, [&](std::size_t first, std::size_t last) {
    std::vector<int> place(nodes, -1);
    std::vector<std::array<double, 3 * kTerms>> sums;
    for (std::size_t c = first; c < last; ++c) {
      Part& part = parts[c];
      sums.clear();
      for (const std::size_t q : points_of[c]) {
        const double* psi = region.psi.data() + kTerms * q;
        for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
          const int node = region.nodes[static_cast<std::size_t>(region.point_nodes[e])];
          int& at = place[static_cast<std::size_t>(node)];
          if (at < 0) {
            at = static_cast<int>(part.nodes.size());
            part.nodes.push_back(node);
            sums.emplace_back().fill(0.0);
          }
          const Vec3 g = region.weights[q] * region.gradients[e];
          for (std::size_t k = 0; k < kTerms; ++k)
            for (std::size_t i = 0; i < 3; ++i)
              sums[static_cast<std::size_t>(at)][3 * k + i] +=
                  psi[k] * g[static_cast<Eigen::Index>(i)];
        }
      }
      for (const auto& sum : sums) {
        Gradients& row = part.rows.emplace_back();
        for (std::size_t i = 0; i < row.size(); ++i) row[i] = static_cast<float>(sum[i]);
      }
      for (const int node : part.nodes) place[static_cast<std::size_t>(node)] = -1;
    }
  });
  for (const Part& part : parts) {
    cell_nodes_.insert(cell_nodes_.end(), part.nodes.begin(), part.nodes.end());
    rows_.insert(rows_.end(), part.rows.begin(), part.rows.end());
    cell_begin_.push_back(cell_nodes_.size());
  }
  for (const int node : cell_nodes_) ++in_begin_[static_cast<std::size_t>(node) + 1];
  for (std::size_t node = 0; node < nodes; ++node) in_begin_[node + 1] += in_begin_[node];
  in_cells_.resize(cell_nodes_.size());
  std::vector<std::size_t> next(in_begin_.begin(), in_begin_.end() - 1);
  for (std::size_t c = 0; c < cells; ++c)
    for (std::size_t e = cell_begin_[c]; e < cell_begin_[c + 1]; ++e)
      in_cells_[next[static_cast<std::size_t>(cell_nodes_[e])]++] = {
          static_cast<int>(c), static_cast<int>(e - cell_begin_[c])};
}

RestStiffness RestStiffness::assemble(std::size_t nodes, const ElasticRegion& region,
                                      const SymmetricBlockMatrix& hold, const RestTerms& terms) {
  RestStiffness out;
  PointFields points;
  points.begin = region.begin;
  for (const int node : region.point_nodes)
    points.nodes.push_back(region.nodes[static_cast<std::size_t>(node)]);
  const NodeIncidence incidence(points, nodes);
  {
    const PointFields pairs = pairs_of(hold);
    whole_rows(
        symmetric_pattern(nodes, {{points, incidence}, {pairs, NodeIncidence(pairs, nodes)}}),
        out.row_begin_, out.columns_);
  }
  out.blocks_.assign(9 * out.columns_.size(), 0.0f);
  const double lambda = region.pointwise_lambda, mu = terms.shear * region.shear_modulus;
  parallel_chunks(nodes, 64, [&](std::size_t first, std::size_t last) {
    std::vector<std::size_t> slot(nodes, 0);
    std::vector<Mat3> sums, pulled;  // of gradients; of fibres
    for (std::size_t row = first; row < last; ++row) {
      const std::span<const int> columns = out.row(row);
      for (std::size_t i = 0; i < columns.size(); ++i)
        slot[static_cast<std::size_t>(columns[i])] = i;
      sums.assign(columns.size(), Mat3::Zero());
      pulled.assign(region.fibres.empty() ? 0 : columns.size(), Mat3::Zero());
      for (const NodeIncidence::Entry& at : incidence.of(row)) {
        const auto q = static_cast<std::size_t>(at.point);
        const Vec3 own = region.weights[q] * region.gradients[at.entry];
        for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e)
          sums[slot[static_cast<std::size_t>(points.nodes[e])]].noalias() +=
              own * region.gradients[e].transpose();
        if (region.fibres.empty() || region.fibres[q].modulus == 0.0) continue;
        const auto& [a, modulus] = region.fibres[q];
        // Their modulus is no multiple of the tissue's, which the weights are.
        const double weight = region.modulus.empty() ? 1.0 : 1.0 / region.modulus[q];
        const Mat3 along = weight * modulus * a.dot(own) * a * a.transpose();
        for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e)
          pulled[slot[static_cast<std::size_t>(points.nodes[e])]] +=
              a.dot(region.gradients[e]) * along;
      }
      float* to = out.blocks_.data() + 9 * out.row_begin_[row];
      for (std::size_t i = 0; i < columns.size(); ++i) {
        Mat3 block = lambda * sums[i] + mu * sums[i].transpose();
        block.diagonal().array() += mu * sums[i].trace();
        if (!pulled.empty()) block += pulled[i];
        if (static_cast<std::size_t>(columns[i]) == row && !terms.inertia.empty())
          block.diagonal().array() += terms.inertia[row] / terms.stiff;
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c)
            to[9 * i + static_cast<std::size_t>(3 * r + c)] =
                static_cast<float>(terms.stiff * block(r, c));
      }
    }
  });
  const auto add_hold = [&](int row, int column, const double* block, bool transposed) {
    const std::span<const int> columns = out.row(static_cast<std::size_t>(row));
    const auto at = std::lower_bound(columns.begin(), columns.end(), column) - columns.begin();
    float* to = out.blocks_.data() +
                9 * (out.row_begin_[static_cast<std::size_t>(row)] + static_cast<std::size_t>(at));
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        to[3 * r + c] +=
            static_cast<float>(terms.stiff * (transposed ? block[3 * c + r] : block[3 * r + c]));
  };
  for (std::size_t row = 0; row < hold.pattern.rows(); ++row)
    for (std::size_t e = hold.pattern.row_begin[row]; e < hold.pattern.row_begin[row + 1]; ++e) {
      const double* block = hold.blocks.data() + 9 * e;
      if (std::all_of(block, block + 9, [](double b) { return b == 0.0; })) continue;
      const int column = hold.pattern.columns[e];
      add_hold(static_cast<int>(row), column, block, false);
      if (column != static_cast<int>(row)) add_hold(column, static_cast<int>(row), block, true);
    }
  out.averaged_ = static_cast<float>(terms.stiff * region.averaged_lambda);
  out.gather_cells(nodes, region);
  return out;
}

void RestStiffness::multiply(const float* x, float* y, std::size_t columns) const {
  std::vector<float> theta(cells() * kTerms * columns, 0.0f);
  parallel_chunks(cells(), 64, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c) {
      float* to = theta.data() + c * kTerms * columns;
      for (std::size_t e = cell_begin_[c]; e < cell_begin_[c + 1]; ++e)
        add_dilatation(rows_[e].data(), x + 3 * columns * static_cast<std::size_t>(cell_nodes_[e]),
                       columns, to);
      for (std::size_t i = 0; i < kTerms * columns; ++i) to[i] *= averaged_;
    }
  });
  parallel_chunks(nodes(), 64, [&](std::size_t first, std::size_t last) {
    for (std::size_t row = first; row < last; ++row) {
      float* to = y + 3 * columns * row;
      std::fill_n(to, 3 * columns, 0.0f);
      add_blocks(blocks(row), this->row(row), x, columns, to);
      for (const InCell& in : cells_of(row)) {
        const auto cell = static_cast<std::size_t>(in.cell);
        add_gradients(rows_[cell_begin_[cell] + static_cast<std::size_t>(in.at)].data(),
                      theta.data() + cell * kTerms * columns, columns, to);
      }
    }
  });
}

std::size_t RestStiffness::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return of(row_begin_) + of(columns_) + of(blocks_) + of(cell_begin_) + of(cell_nodes_) +
         of(rows_) + of(in_begin_) + of(in_cells_);
}

}  // namespace viscera
