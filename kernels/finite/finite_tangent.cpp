// The second derivative of the energy, cell by cell.
#include <Eigen/Geometry>
#include <algorithm>

#include "kernels/finite/fibre_law.h"
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

/// With nothing moved F is the identity, and a point's block is linear elasticity's,
///   w (lambda g_I g_J^T + mu g_J g_I^T + mu g_I.g_J 1):
/// the material enters once a block, not once a point.
SymmetricBlockMatrix FiniteBody::pointwise_at_rest(double shear) const {
  PointFields points;
  std::vector<std::size_t> numbers;  // of lanes
  std::vector<std::pair<int, Vec3>> at_point;
  for (const Piece& piece : pieces_)
    for (std::size_t pack = cell_begin_[piece.first_cell]; pack < cell_begin_[piece.last_cell];
         ++pack)
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (!(weights_[pack][lane] > 0.0)) continue;
        at_point.clear();
        each_node(pack, lane, [&](std::size_t number, const Vec3& g) {
          at_point.emplace_back(piece.nodes[number], g);
        });
        std::ranges::sort(at_point, {}, &std::pair<int, Vec3>::first);
        for (const auto& [node, gradient] : at_point) {
          points.nodes.push_back(node);
          points.gradients.push_back(gradient);
        }
        points.begin.push_back(points.nodes.size());
        numbers.push_back(kLanes * pack + lane);
      }
  PointFields pairs;
  hold_.each([&](int row, int column, const Mat3&) {
    pairs.nodes.push_back(std::min(row, column));
    if (row != column) pairs.nodes.push_back(std::max(row, column));
    pairs.begin.push_back(pairs.nodes.size());
  });

  const NodeIncidence incidence(points, nodes_);
  SymmetricBlockMatrix tangent;
  tangent.width = 3;
  tangent.pattern =
      symmetric_pattern(nodes_, {{points, incidence}, {pairs, NodeIncidence(pairs, nodes_)}});
  tangent.blocks.assign(9 * tangent.pattern.columns.size(), 0.0);
  const double mu = shear * mu_, lambda = lambda_ + averaged_;
  for_each_row(tangent.pattern, [&](std::size_t row, std::span<const std::size_t> slot) {
    const std::size_t begin = tangent.pattern.row_begin[row],
                      end = tangent.pattern.row_begin[row + 1];
    std::vector<Mat3> sums(end - begin, Mat3::Zero()), pulled(fibres_.empty() ? 0 : end - begin);
    for (Mat3& sum : pulled) sum.setZero();
    for (const NodeIncidence::Entry& at : incidence.of(row)) {
      const auto q = static_cast<std::size_t>(at.point);
      const std::size_t pack = numbers[q] / kLanes, lane = numbers[q] % kLanes;
      const double w = weights_[pack][lane];
      const Vec3 own = w * points.gradients[at.entry];
      for (std::size_t e = at.entry; e < points.begin[q + 1]; ++e)
        sums[slot[static_cast<std::size_t>(points.nodes[e])] - begin].noalias() +=
            own * points.gradients[e].transpose();
      if (fibres_.empty()) continue;
      const Vec3 along = fibre_direction(pack, lane);
      const FibreLaw law{fibres_[pack].quarter[lane], fibres_[pack].bend[lane]};
      const Mat3 stiff = 4.0 * law.curvature(0.0) * along.dot(own) * along * along.transpose();
      for (std::size_t e = at.entry; e < points.begin[q + 1]; ++e)
        pulled[slot[static_cast<std::size_t>(points.nodes[e])] - begin] +=
            along.dot(points.gradients[e]) * stiff;
    }
    for (std::size_t e = begin; e < end; ++e) {
      const Mat3& sum = sums[e - begin];
      Mat3 block = lambda * sum + mu * sum.transpose();
      block.diagonal().array() += mu * sum.trace();
      if (!pulled.empty()) block += pulled[e - begin];
      // A diagonal block is symmetric but for the order of its sums.
      if (e == begin) block = 0.5 * (block + block.transpose()).eval();
      for (std::size_t i = 0; i < 9; ++i)
        tangent.blocks[9 * e + i] =
            block(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3));
    }
  });
  add_hold(tangent);
  return tangent;
}

void FiniteBody::add_hold(SymmetricBlockMatrix& tangent) const {
  hold_.each([&](int row, int column, const Mat3& block) {
    double* to = tangent.blocks.data() + 9 * slot_of(tangent.pattern, row, column);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) to[3 * i + j] += block(i, j);
  });
}

SymmetricBlockMatrix FiniteBody::tangent(std::span<const double> displacements,
                                         const TangentChange& change_of) const {
  if (change_of.pointwise && unloaded_.empty() &&
      std::ranges::all_of(displacements, [](double d) { return d == 0.0; }))
    return pointwise_at_rest(change_of.shear);
  std::vector<double> room;
  displacements = from_unloaded(displacements, room);
  const bool averages = !psi_.empty() && !change_of.pointwise;
  const double mu = change_of.shear * mu_, lambda = lambda_ + (averages ? 0.0 : averaged_);
  const auto nodes_of_cell = [&](const Piece& piece, std::size_t cell) {
    std::vector<int> nodes;
    for (std::size_t e = begin_[cell_begin_[cell]]; e < begin_[cell_begin_[cell + 1]]; ++e)
      nodes.push_back(piece.nodes[entry_nodes_[e]]);
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
  };
  // Each cell that averages, each point where none does, and each row of the hold couples all nodes
  // that it reaches.
  PointFields groups;
  const auto add_group = [&](const std::vector<int>& nodes) {
    groups.nodes.insert(groups.nodes.end(), nodes.begin(), nodes.end());
    groups.begin.push_back(groups.nodes.size());
  };
  const auto add_points = [&](const Piece& piece, std::size_t pack) {
    std::vector<int> nodes;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!(weights_[pack][lane] > 0.0)) continue;
      nodes.clear();
      each_node(pack, lane,
                [&](std::size_t number, const Vec3&) { nodes.push_back(piece.nodes[number]); });
      std::sort(nodes.begin(), nodes.end());
      add_group(nodes);
    }
  };
  for (const Piece& piece : pieces_)
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c) {
      if (averages)
        add_group(nodes_of_cell(piece, c));
      else
        for (std::size_t p = cell_begin_[c]; p < cell_begin_[c + 1]; ++p) add_points(piece, p);
    }
  hold_.each([&](int row, int column, const Mat3&) {
    add_group({std::min(row, column), std::max(row, column)});
  });

  SymmetricBlockMatrix tangent;
  tangent.width = 3;
  tangent.pattern = symmetric_pattern(nodes_, {{groups, NodeIncidence(groups, nodes_)}});
  tangent.blocks.assign(9 * tangent.pattern.columns.size(), 0.0);
  const auto add = [&](int row, int column, const Mat3& block) {
    double* to = tangent.blocks.data() + 9 * slot_of(tangent.pattern, row, column);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) to[3 * i + j] += block(i, j);
  };

  for (const Piece& piece : pieces_) {
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c) {
      const std::vector<int> nodes = nodes_of_cell(piece, c);
      const auto n = static_cast<Eigen::Index>(3 * nodes.size());
      MatrixX dense = MatrixX::Zero(n, n);
      Eigen::Matrix<double, Eigen::Dynamic, 4> change = MatrixX::Zero(n, 4);  // of theta
      Vec4 theta = Vec4::Zero();
      const std::size_t first = cell_begin_[c], last = cell_begin_[c + 1];
      struct Point {
        std::size_t pack, lane;
        double weight;
        Mat3 f;
        Vec4 psi = Vec4::Zero();
      };
      std::vector<Point> points;
      for (std::size_t p = first; p < last; ++p)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          if (!(weights_[p][lane] > 0.0)) continue;
          Point point{p, lane, weights_[p][lane], gradient_at(p, lane, piece, displacements)};
          if (averages)
            for (std::size_t k = 0; k < kTerms; ++k)
              point.psi[static_cast<Eigen::Index>(k)] = psi_[p][k][lane];
          theta += point.weight * (point.f.determinant() - 1.0) * point.psi;
          points.push_back(point);
        }
      for (const Point& point : points) {
        const Mat3& at = point.f;
        const Mat3 cof = cofactor(at);
        double pressure = -mu + (lambda + mu) * (at.determinant() - 1.0);
        if (averages) pressure += averaged_ * theta.dot(point.psi);
        const double w = point.weight;
        // Of fibres: a, F a, and what the derivatives of their energy by |F a|^2 make.
        Vec3 along = Vec3::Zero(), moved = Vec3::Zero();
        double pull = 0.0, stiffening = 0.0;
        if (!fibres_.empty()) {
          along = fibre_direction(point.pack, point.lane);
          moved = at * along;
          const FibrePack& pack = fibres_[point.pack];
          const FibreLaw law{pack.quarter[point.lane], pack.bend[point.lane]};
          const double stretched = moved.squaredNorm() - 1.0;
          pull = 2.0 * law.slope(stretched);
          stiffening = 4.0 * law.curvature(stretched);
        }
        struct Entry {
          Eigen::Index row;
          Vec3 g, a;
        };
        std::vector<Entry> entries;
        each_node(point.pack, point.lane, [&](std::size_t number, const Vec3& g) {
          const int node = piece.nodes[number];
          const auto row = 3 * (std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
          entries.push_back({row, g, cof * g});
          change.middleRows<3>(row) += w * entries.back().a * point.psi.transpose();
        });
        for (const Entry& one : entries)
          for (const Entry& other : entries) {
            Mat3 block = (lambda + mu) * one.a * other.a.transpose() -
                         pressure * cross_matrix(at * one.g.cross(other.g));
            block.diagonal().array() += mu * one.g.dot(other.g);
            if (!fibres_.empty()) {
              const double both = along.dot(one.g) * along.dot(other.g);
              block.diagonal().array() += pull * both;
              block += stiffening * both * moved * moved.transpose();
            }
            dense.block<3, 3>(one.row, other.row) += w * block;
          }
      }
      if (averages) dense += averaged_ * change * change.transpose();
      for (std::size_t i = 0; i < nodes.size(); ++i)
        for (std::size_t j = i; j < nodes.size(); ++j) {
          const auto block =
              dense.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j));
          if (averages || !block.isZero(0.0)) add(nodes[i], nodes[j], block);
        }
    }
  }
  add_hold(tangent);
  return tangent;
}

}  // namespace viscera
