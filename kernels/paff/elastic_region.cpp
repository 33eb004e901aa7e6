#include "kernels/paff/elastic_region.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace viscera {
namespace {

constexpr int kTerms = static_cast<int>(ElasticRegion::kTerms);

/// The square root of the isotropic stiffness on normal strains is a I + b (1 1^T), on shears (as
/// sqrt(2) eps_xy) it is a.
struct StiffnessRoot {
  double along, across;

  explicit StiffnessRoot(const ElasticRegion& region) {
    along = std::sqrt(2.0 * region.shear_modulus);
    across = (std::sqrt(2.0 * region.shear_modulus + 3.0 * region.pointwise_lambda) - along) / 3.0;
  }
};

/// sum_q w (f - 1) psi psi^T of each cell.
std::vector<Eigen::Matrix4d> cell_excesses(const ElasticRegion& region,
                                           std::span<const double> factors) {
  std::vector<Eigen::Matrix4d> excess(region.cells(), Eigen::Matrix4d::Zero());
  for (std::size_t q = 0; q < region.cell.size(); ++q) {
    const Vec4 psi = Vec4::Map(region.psi.data() + ElasticRegion::kTerms * q);
    excess[static_cast<std::size_t>(region.cell[q])] +=
        region.weights[q] * (factors[q] - 1.0) * psi * psi.transpose();
  }
  return excess;
}

}  // namespace

std::size_t ElasticRegion::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return of(nodes) + of(positions) + of(weights) + of(modulus) + of(fibres) + of(begin) +
         of(point_nodes) + of(gradients) + of(cell) + of(psi) + of(cell_begin) + of(cell_nodes) +
         of(cell_gradients);
}

void number_nodes(std::size_t node_count, ElasticRegion& region) {
  std::vector<int> number(node_count, -1);
  for (const int node : region.point_nodes) number[static_cast<std::size_t>(node)] = 0;
  for (const int node : region.cell_nodes) number[static_cast<std::size_t>(node)] = 0;
  region.nodes.clear();
  for (std::size_t node = 0; node < node_count; ++node) {
    if (number[node] < 0) continue;
    number[node] = static_cast<int>(region.nodes.size());
    region.nodes.push_back(static_cast<int>(node));
  }
  for (int& node : region.point_nodes) node = number[static_cast<std::size_t>(node)];
  for (int& node : region.cell_nodes) node = number[static_cast<std::size_t>(node)];
}

AddedStiffness added_stiffness(const ElasticRegion& region, std::span<const double> factors) {
  std::vector<std::size_t> points, cells;
  std::vector<char> touched(region.nodes.size(), 0);
  for (std::size_t q = 0; q < region.size(); ++q) {
    if (!(factors[q] > 1.0)) continue;
    points.push_back(q);
    for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
      touched[static_cast<std::size_t>(region.point_nodes[e])] = 1;
    }
    if (!region.cell.empty()) cells.push_back(static_cast<std::size_t>(region.cell[q]));
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  for (const std::size_t c : cells) {
    for (std::size_t e = region.cell_begin[c]; e < region.cell_begin[c + 1]; ++e) {
      touched[static_cast<std::size_t>(region.cell_nodes[e])] = 1;
    }
  }
  AddedStiffness added;
  std::vector<Eigen::Index> column(region.nodes.size(), -1);
  for (std::size_t i = 0; i < touched.size(); ++i) {
    if (!touched[i]) continue;
    column[i] = 3 * static_cast<Eigen::Index>(added.nodes.size());
    added.nodes.push_back(static_cast<int>(i));
  }
  const Eigen::Index rows_of_point = region.fibres.empty() ? 6 : 7;
  added.roots.setZero(rows_of_point * static_cast<Eigen::Index>(points.size()) +
                          static_cast<Eigen::Index>(ElasticRegion::kTerms * cells.size()),
                      3 * static_cast<Eigen::Index>(added.nodes.size()));
  const StiffnessRoot root(region);
  Eigen::Index row = 0;
  for (const std::size_t q : points) {
    const double scale = std::sqrt(region.weights[q] * (factors[q] - 1.0));
    for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
      const Vec3 g = scale * region.gradients[e];
      const Eigen::Index at = column[static_cast<std::size_t>(region.point_nodes[e])];
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) added.roots(row + i, at + k) += root.across * g[k];
        added.roots(row + i, at + i) += root.along * g[i];
        // sqrt(2) eps of the other two axes.
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        added.roots(row + 3 + i, at + j) += root.along * std::sqrt(0.5) * g[k];
        added.roots(row + 3 + i, at + k) += root.along * std::sqrt(0.5) * g[j];
      }
      if (region.fibres.empty()) continue;
      const auto& [direction, modulus] = region.fibres[q];
      const double along = std::sqrt(region.volume(q) * (factors[q] - 1.0) * modulus) *
                           direction.dot(region.gradients[e]);
      for (int k = 0; k < 3; ++k) added.roots(row + 6, at + k) += along * direction[k];
    }
    row += rows_of_point;
  }
  if (cells.empty()) return added;
  const std::vector<Eigen::Matrix4d> excess = cell_excesses(region, factors);
  for (const std::size_t c : cells) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> modes(excess[c]);
    const Eigen::Matrix4d halves = std::sqrt(region.averaged_lambda) *
                                   modes.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
                                   modes.eigenvectors().transpose();
    const std::size_t width = region.cell_begin[c + 1] - region.cell_begin[c];
    for (std::size_t i = 0; i < width; ++i) {
      const auto node = static_cast<std::size_t>(region.cell_nodes[region.cell_begin[c] + i]);
      Eigen::Matrix<double, kTerms, 3> gradients;
      for (int k = 0; k < kTerms; ++k) {
        gradients.row(k) = region
                               .cell_gradients[ElasticRegion::kTerms * region.cell_begin[c] +
                                               static_cast<std::size_t>(k) * width + i]
                               .transpose();
      }
      added.roots.block<kTerms, 3>(row, column[node]) = halves * gradients;
    }
    row += kTerms;
  }
  return added;
}

VectorX eigenstrain_load(const ElasticRegion& region, std::span<const double> factors,
                         std::span<const double> eigenstrains) {
  VectorX load = VectorX::Zero(3 * static_cast<Eigen::Index>(region.nodes.size()));
  const auto of = [&](int node) { return load.segment<3>(3 * static_cast<Eigen::Index>(node)); };
  const double pressure = 2.0 * region.shear_modulus + 3.0 * region.pointwise_lambda;
  std::vector<Vec4> fluxes(region.cells(), Vec4::Zero());
  for (std::size_t q = 0; q < region.size(); ++q) {
    const double strain = region.weights[q] * factors[q] * eigenstrains[q];
    if (strain == 0.0) continue;
    for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
      of(region.point_nodes[e]) += strain * pressure * region.gradients[e];
      if (region.fibres.empty()) continue;
      const auto& [direction, modulus] = region.fibres[q];
      of(region.point_nodes[e]) += region.volume(q) * factors[q] * eigenstrains[q] * modulus *
                                   direction.dot(region.gradients[e]) * direction;
    }
    if (region.cell.empty()) continue;
    fluxes[static_cast<std::size_t>(region.cell[q])] +=
        3.0 * region.averaged_lambda * strain *
        Vec4::Map(region.psi.data() + ElasticRegion::kTerms * q);
  }
  for (std::size_t c = 0; c < region.cells(); ++c) {
    if (fluxes[c].isZero(0.0)) continue;
    const std::size_t width = region.cell_begin[c + 1] - region.cell_begin[c];
    for (std::size_t i = 0; i < ElasticRegion::kTerms * width; ++i) {
      of(region.cell_nodes[region.cell_begin[c] + i % width]) +=
          fluxes[c][static_cast<int>(i / width)] *
          region.cell_gradients[ElasticRegion::kTerms * region.cell_begin[c] + i];
    }
  }
  return load;
}

void add_stiffness(const ElasticRegion& region, std::span<const double> factors,
                   SymmetricBlockMatrix& stiffness) {
  const AddedStiffness added = added_stiffness(region, factors);
  const MatrixX more = added.roots.transpose() * added.roots;
  const SymmetricPattern& pattern = stiffness.pattern;
  const auto node = [&](std::size_t i) {
    return region.nodes[static_cast<std::size_t>(added.nodes[i])];
  };
  for (std::size_t i = 0; i < added.nodes.size(); ++i) {
    const auto row = static_cast<std::size_t>(node(i));
    const auto first =
        pattern.columns.begin() + static_cast<std::ptrdiff_t>(pattern.row_begin[row]);
    const auto last =
        pattern.columns.begin() + static_cast<std::ptrdiff_t>(pattern.row_begin[row + 1]);
    for (std::size_t j = i; j < added.nodes.size(); ++j) {
      const auto at = std::lower_bound(first, last, node(j));
      // Nodes that share no point: their block is zero.
      if (at == last || *at != node(j)) continue;
      using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      Eigen::Map<Block>(stiffness.blocks.data() + 9 * (at - pattern.columns.begin())) +=
          more.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
    }
  }
}

}  // namespace viscera
