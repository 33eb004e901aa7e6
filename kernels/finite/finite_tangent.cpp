// The second derivative of the energy, cell by cell.
#include <Eigen/Geometry>
#include <algorithm>

#include "kernels/finite/finite_body.h"
#include "kernels/paff/point_fields.h"

namespace viscera {
namespace {

constexpr std::size_t kTerms = ElasticRegion::kTerms;

Mat3 cofactor(const Mat3& f) {
  Mat3 c;
  c.col(0) = f.col(1).cross(f.col(2));
  c.col(1) = f.col(2).cross(f.col(0));
  c.col(2) = f.col(0).cross(f.col(1));
  return c;
}

Mat3 cross_matrix(const Vec3& m) {
  Mat3 matrix;
  matrix << 0.0, -m.z(), m.y(), m.z(), 0.0, -m.x(), -m.y(), m.x(), 0.0;
  return matrix;
}

/// Where the block (row, column), column >= row, stands.
std::size_t slot_of(const SymmetricPattern& pattern, int row, int column) {
  const auto at = [&](std::size_t i) {
    return pattern.columns.begin() + static_cast<std::ptrdiff_t>(i);
  };
  const auto first = at(pattern.row_begin[static_cast<std::size_t>(row)]),
             last = at(pattern.row_begin[static_cast<std::size_t>(row) + 1]);
  return static_cast<std::size_t>(std::lower_bound(first, last, column) - pattern.columns.begin());
}

}  // namespace

SymmetricBlockMatrix FiniteBody::tangent(std::span<const double> displacements,
                                         double shear) const {
  const double mu = shear * mu_;
  // Each cell, and each row of the hold, couples all nodes that it reaches.
  PointFields groups;
  const auto add_group = [&](std::vector<int> nodes) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    groups.nodes.insert(groups.nodes.end(), nodes.begin(), nodes.end());
    groups.begin.push_back(groups.nodes.size());
  };
  for (const Piece& piece : pieces_)
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c) {
      std::vector<int> nodes;
      for (std::size_t e = begin_[cell_begin_[c]]; e < begin_[cell_begin_[c + 1]]; ++e)
        nodes.push_back(piece.nodes[entry_nodes_[e]]);
      add_group(std::move(nodes));
    }
  const auto hold_node = [&](int number) { return hold_nodes_[static_cast<std::size_t>(number)]; };
  const SymmetricPattern& held = hold_.pattern;
  for (std::size_t row = 0; row < held.rows(); ++row)
    for (std::size_t e = held.row_begin[row]; e < held.row_begin[row + 1]; ++e)
      add_group({hold_nodes_[row], hold_node(held.columns[e])});

  SymmetricBlockMatrix tangent;
  tangent.width = 3;
  tangent.pattern = symmetric_pattern(nodes_, {{groups, NodeIncidence(groups, nodes_)}});
  tangent.blocks.assign(9 * tangent.pattern.columns.size(), 0.0);
  const auto add = [&](int row, int column, const Mat3& block) {
    double* to = tangent.blocks.data() + 9 * slot_of(tangent.pattern, row, column);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) to[3 * i + j] += block(i, j);
  };

  std::size_t group = 0;
  for (const Piece& piece : pieces_) {
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c, ++group) {
      const std::span nodes(groups.nodes.data() + groups.begin[group],
                            groups.begin[group + 1] - groups.begin[group]);
      const auto n = static_cast<Eigen::Index>(3 * nodes.size());
      MatrixX dense = MatrixX::Zero(n, n);
      Eigen::Matrix<double, Eigen::Dynamic, 4> change = MatrixX::Zero(n, 4);  // of theta
      Vec4 theta = Vec4::Zero();
      const std::size_t first = cell_begin_[c], last = cell_begin_[c + 1];
      std::vector<Mat3> f(last - first);
      for (std::size_t q = first; q < last; ++q) {
        f[q - first] = gradient_at(q, piece, displacements);
        if (!psi_.empty())
          theta += weights_[q] * (f[q - first].determinant() - 1.0) * Vec4::Map(psi_[q].data());
      }
      for (std::size_t q = first; q < last; ++q) {
        const Mat3& at = f[q - first];
        const Mat3 cof = cofactor(at);
        double pressure = -mu + (lambda_ + mu) * (at.determinant() - 1.0);
        if (!psi_.empty()) pressure += averaged_ * theta.dot(Vec4::Map(psi_[q].data()));
        const double w = weights_[q];
        struct Entry {
          Eigen::Index row;
          Vec3 g, a;
        };
        std::vector<Entry> entries;
        for (std::size_t e = begin_[q]; e < begin_[q + 1]; ++e) {
          const int node = piece.nodes[entry_nodes_[e]];
          const Vec3 g = Vec3::Map(gradients_[e].data());
          const auto row = 3 * (std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
          entries.push_back({row, g, cof * g});
          if (!psi_.empty())
            change.middleRows<3>(row) +=
                w * entries.back().a * Vec4::Map(psi_[q].data()).transpose();
        }
        for (const Entry& one : entries)
          for (const Entry& other : entries) {
            Mat3 block = (lambda_ + mu) * one.a * other.a.transpose() -
                         pressure * cross_matrix(at * one.g.cross(other.g));
            block.diagonal().array() += mu * one.g.dot(other.g);
            dense.block<3, 3>(one.row, other.row) += w * block;
          }
      }
      dense += averaged_ * change * change.transpose();
      for (std::size_t i = 0; i < nodes.size(); ++i)
        for (std::size_t j = i; j < nodes.size(); ++j)
          add(nodes[i], nodes[j],
              dense.block<3, 3>(static_cast<Eigen::Index>(3 * i),
                                static_cast<Eigen::Index>(3 * j)));
    }
  }
  for (std::size_t row = 0; row < held.rows(); ++row)
    for (std::size_t e = held.row_begin[row]; e < held.row_begin[row + 1]; ++e) {
      Mat3 block;
      for (int i = 0; i < 9; ++i)
        block(i / 3, i % 3) = hold_.blocks[9 * e + static_cast<std::size_t>(i)];
      add(hold_nodes_[row], hold_node(held.columns[e]), block);
    }
  return tangent;
}

}  // namespace viscera
