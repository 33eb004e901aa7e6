#include "kernels/finite/finite_body.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

/// Points of a piece, about: enough to be worth a thread, few enough that its nodes stay in the
/// nearest cache.
constexpr std::size_t kPointsOfPiece = 1024;
/// Points that share a "cell" where nothing is averaged.
constexpr std::size_t kPointsWithoutCell = 64;

constexpr std::size_t kTerms = ElasticRegion::kTerms;

/// A Quad in a register. What is made of it is always inlined: how it would be passed depends on
/// the instructions that a function may use.
using Lanes = double __attribute__((vector_size(32)));

#define VISCERA_INLINE [[gnu::always_inline]] inline

VISCERA_INLINE void load(const Quad& from, Lanes& to) {
  std::memcpy(&to, from.data(), sizeof(to));
}

VISCERA_INLINE void store(const Lanes& from, Quad& to) {
  std::memcpy(to.data(), &from, sizeof(from));
}

VISCERA_INLINE void cross(const Lanes& a, const Lanes& b, Lanes& c) {
  c = Lanes{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0};
}

VISCERA_INLINE double dot(const Lanes& a, const Lanes& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Of a point: columns of F, its determinant, and how the strain has changed within the step.
struct PointStrain {
  Quad f[3];
  double j = 1.0;
  double strain_change[6];
};

/// What evaluating a cell reads.
struct CellView {
  std::size_t points;
  const std::size_t* begin;  // of the points, one more than these
  const std::uint16_t* nodes;
  const std::array<double, 3>* gradients;
  const double* weights;
  const std::array<double, 4>* psi;  // null: nothing is averaged
  double mu, lambda, averaged;
  double viscous;        // time mu / dt [Pa]; 0: none
  const double* before;  // strains of its points, six each
};

/// E = (F^T F - 1) / 2 as xx, yy, zz, xy, yz, zx.
VISCERA_INLINE void green_strain(const Lanes& f0, const Lanes& f1, const Lanes& f2, double* e) {
  e[0] = 0.5 * (dot(f0, f0) - 1.0);
  e[1] = 0.5 * (dot(f1, f1) - 1.0);
  e[2] = 0.5 * (dot(f2, f2) - 1.0);
  e[3] = 0.5 * dot(f0, f1);
  e[4] = 0.5 * dot(f1, f2);
  e[5] = 0.5 * dot(f2, f0);
}

/// Energy of a cell; adds forces to `forces` unless that is null. `strains` has room for its
/// points.
VISCERA_WIDE double add_cell(const CellView& cell, const Quad* displacements, PointStrain* strains,
                             Quad* forces) {
  double energy = 0.0;
  double theta[kTerms] = {};
  for (std::size_t q = 0; q < cell.points; ++q) {
    Lanes f0{1.0, 0.0, 0.0, 0.0}, f1{0.0, 1.0, 0.0, 0.0}, f2{0.0, 0.0, 1.0, 0.0};
    for (std::size_t e = cell.begin[q]; e < cell.begin[q + 1]; ++e) {
      Lanes u;
      load(displacements[cell.nodes[e]], u);
      const std::array<double, 3>& g = cell.gradients[e];
      f0 += u * g[0];
      f1 += u * g[1];
      f2 += u * g[2];
    }
    PointStrain& at = strains[q];
    store(f0, at.f[0]);
    store(f1, at.f[1]);
    store(f2, at.f[2]);
    Lanes a0;
    cross(f1, f2, a0);
    at.j = dot(f0, a0);
    const double grown = at.j - 1.0;
    const double length = dot(f0, f0) + dot(f1, f1) + dot(f2, f2);
    energy += cell.weights[q] * (0.5 * cell.mu * (length - 3.0) - cell.mu * grown +
                                 0.5 * (cell.lambda + cell.mu) * grown * grown);
    if (cell.viscous > 0.0) {
      double* e = at.strain_change;
      green_strain(f0, f1, f2, e);
      for (std::size_t k = 0; k < 6; ++k) e[k] -= cell.before[6 * q + k];
      energy += cell.weights[q] * cell.viscous *
                (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] +
                 2.0 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5]));
    }
    if (cell.psi != nullptr)
      for (std::size_t k = 0; k < kTerms; ++k) theta[k] += cell.weights[q] * cell.psi[q][k] * grown;
  }
  for (const double t : theta) energy += 0.5 * cell.averaged * t * t;
  if (forces == nullptr) return energy;

  for (std::size_t q = 0; q < cell.points; ++q) {
    const PointStrain& at = strains[q];
    double pressure = -cell.mu + (cell.lambda + cell.mu) * (at.j - 1.0);
    if (cell.psi != nullptr)
      for (std::size_t k = 0; k < kTerms; ++k)
        pressure += cell.averaged * theta[k] * cell.psi[q][k];
    const double w = cell.weights[q];
    Lanes f0, f1, f2, a0, a1, a2;
    load(at.f[0], f0);
    load(at.f[1], f1);
    load(at.f[2], f2);
    cross(f1, f2, a0);
    cross(f2, f0, a1);
    cross(f0, f1, a2);
    Lanes p0 = w * (cell.mu * f0 + pressure * a0);
    Lanes p1 = w * (cell.mu * f1 + pressure * a1);
    Lanes p2 = w * (cell.mu * f2 + pressure * a2);
    if (cell.viscous > 0.0) {
      const double* e = at.strain_change;
      const double rate = 2.0 * w * cell.viscous;
      p0 += rate * (e[0] * f0 + e[3] * f1 + e[5] * f2);
      p1 += rate * (e[3] * f0 + e[1] * f1 + e[4] * f2);
      p2 += rate * (e[5] * f0 + e[4] * f1 + e[2] * f2);
    }
    for (std::size_t e = cell.begin[q]; e < cell.begin[q + 1]; ++e) {
      const std::array<double, 3>& g = cell.gradients[e];
      Lanes force;
      load(forces[cell.nodes[e]], force);
      force += p0 * g[0] + p1 * g[1] + p2 * g[2];
      store(force, forces[cell.nodes[e]]);
    }
  }
  return energy;
}

Quad quad_of(std::span<const double> vectors, int node) {
  const double* at = vectors.data() + 3 * static_cast<std::size_t>(node);
  return Quad{at[0], at[1], at[2], 0.0};
}

/// Points in the order of their cells; without cells, in groups as they come.
struct PointOrder {
  std::vector<std::size_t> points;
  std::vector<std::size_t> cell_begin{0};
};

PointOrder order_of(const ElasticRegion& region) {
  PointOrder order;
  order.points.resize(region.size());
  std::iota(order.points.begin(), order.points.end(), std::size_t{0});
  if (region.cell.empty()) {
    for (std::size_t q = kPointsWithoutCell; q < region.size(); q += kPointsWithoutCell)
      order.cell_begin.push_back(q);
    order.cell_begin.push_back(region.size());
    return order;
  }
  std::stable_sort(order.points.begin(), order.points.end(),
                   [&](std::size_t a, std::size_t b) { return region.cell[a] < region.cell[b]; });
  for (std::size_t i = 1; i <= order.points.size(); ++i)
    if (i == order.points.size() ||
        region.cell[order.points[i]] != region.cell[order.points[i - 1]])
      order.cell_begin.push_back(i);
  return order;
}

bool is_zero(const SymmetricBlockMatrix& matrix, std::size_t entry) {
  const auto first = matrix.blocks.begin() + static_cast<std::ptrdiff_t>(9 * entry);
  return std::all_of(first, first + 9, [](double value) { return value == 0.0; });
}

/// The same matrix over the nodes that it has blocks for, which `nodes` lists.
SymmetricBlockMatrix without_zeros(const SymmetricBlockMatrix& matrix, std::vector<int>& nodes) {
  const SymmetricPattern& pattern = matrix.pattern;
  std::vector<int> number(pattern.rows(), -1);
  const auto each = [&](const auto& visit) {
    for (std::size_t row = 0; row < pattern.rows(); ++row)
      for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e)
        if (!is_zero(matrix, e)) visit(row, static_cast<std::size_t>(pattern.columns[e]), e);
  };
  each([&](std::size_t row, std::size_t column, std::size_t) { number[row] = number[column] = 0; });
  nodes.clear();
  for (std::size_t node = 0; node < number.size(); ++node) {
    if (number[node] < 0) continue;
    number[node] = static_cast<int>(nodes.size());
    nodes.push_back(static_cast<int>(node));
  }
  SymmetricBlockMatrix kept;
  kept.width = 3;
  kept.pattern.row_begin.assign(nodes.size() + 1, 0);
  // Every row has its diagonal, as the pattern promises.
  for (const int node : nodes) {
    const auto row = static_cast<std::size_t>(node);
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      if (e != pattern.row_begin[row] && is_zero(matrix, e)) continue;
      kept.pattern.columns.push_back(number[static_cast<std::size_t>(pattern.columns[e])]);
      const auto first = matrix.blocks.begin() + static_cast<std::ptrdiff_t>(9 * e);
      kept.blocks.insert(kept.blocks.end(), first, first + 9);
    }
    kept.pattern.row_begin[static_cast<std::size_t>(number[row]) + 1] = kept.pattern.columns.size();
  }
  return kept;
}

}  // namespace

Result<FiniteBody> FiniteBody::create(const ElasticRegion& region,
                                      const SymmetricBlockMatrix& hold) {
  FiniteBody body;
  body.nodes_ = hold.pattern.rows();
  body.mu_ = region.shear_modulus;
  body.lambda_ = region.pointwise_lambda;
  body.averaged_ = region.averaged_lambda;
  const PointOrder order = order_of(region);
  body.cell_begin_ = order.cell_begin;
  std::vector<int> number(body.nodes_, -1);
  for (std::size_t cell = 0; cell < body.cells();) {
    Piece piece;
    piece.first_cell = cell;
    const std::size_t first = body.cell_begin_[cell];
    for (; cell < body.cells() &&
           (cell == piece.first_cell || body.cell_begin_[cell + 1] - first <= kPointsOfPiece);
         ++cell) {
      for (std::size_t i = body.cell_begin_[cell]; i < body.cell_begin_[cell + 1]; ++i) {
        const std::size_t q = order.points[i];
        for (std::size_t e = region.begin[q]; e < region.begin[q + 1]; ++e) {
          const int node = region.nodes[static_cast<std::size_t>(region.point_nodes[e])];
          int& own = number[static_cast<std::size_t>(node)];
          if (own < 0) {
            own = static_cast<int>(piece.nodes.size());
            piece.nodes.push_back(node);
          }
          if (own > std::numeric_limits<std::uint16_t>::max())
            return failure("nodes: one group of quadrature points reaches over 65535 of them");
          body.entry_nodes_.push_back(static_cast<std::uint16_t>(own));
          const Vec3& g = region.gradients[e];
          body.gradients_.push_back({g.x(), g.y(), g.z()});
        }
        body.begin_.push_back(body.entry_nodes_.size());
        body.weights_.push_back(region.weights[q]);
        body.volume_ += region.weights[q];
        if (!region.cell.empty()) {
          const double* psi = region.psi.data() + kTerms * q;
          body.psi_.push_back({psi[0], psi[1], psi[2], psi[3]});
        }
      }
    }
    piece.last_cell = cell;
    for (const int node : piece.nodes) number[static_cast<std::size_t>(node)] = -1;
    body.pieces_.push_back(std::move(piece));
  }
  body.hold_ = without_zeros(hold, body.hold_nodes_);

  // A node has a cell's gradient by the volume of the points of that cell which it reaches.
  std::vector<std::vector<std::pair<int, double>>> shares(body.nodes_);
  for (const Piece& piece : body.pieces_)
    for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
      for (std::size_t q = body.cell_begin_[c]; q < body.cell_begin_[c + 1]; ++q)
        for (std::size_t e = body.begin_[q]; e < body.begin_[q + 1]; ++e) {
          auto& of = shares[static_cast<std::size_t>(piece.nodes[body.entry_nodes_[e]])];
          if (of.empty() || of.back().first != static_cast<int>(c))
            of.emplace_back(static_cast<int>(c), 0.0);
          of.back().second += body.weights_[q];
        }
  for (const auto& of : shares) {
    double sum = 0.0;
    for (const auto& [cell, weight] : of) sum += weight;
    for (const auto& [cell, weight] : of) {
      body.share_cells_.push_back(cell);
      body.shares_.push_back(weight / sum);
    }
    body.share_begin_.push_back(body.shares_.size());
  }
  return body;
}

double FiniteBody::add_piece(const Piece& piece, std::span<const double> displacements,
                             bool with_forces, const Viscosity& viscosity,
                             std::vector<Quad>& forces) const {
  std::vector<Quad> own(piece.nodes.size());
  for (std::size_t i = 0; i < own.size(); ++i) own[i] = quad_of(displacements, piece.nodes[i]);
  if (with_forces) forces.assign(own.size(), Quad{});
  std::size_t most = 0;
  for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c)
    most = std::max(most, cell_begin_[c + 1] - cell_begin_[c]);
  std::vector<PointStrain> strains(most);
  double energy = 0.0;
  for (std::size_t c = piece.first_cell; c < piece.last_cell; ++c) {
    const std::size_t first = cell_begin_[c];
    const CellView cell = {
        .points = cell_begin_[c + 1] - first,
        .begin = begin_.data() + first,
        .nodes = entry_nodes_.data(),
        .gradients = gradients_.data(),
        .weights = weights_.data() + first,
        .psi = psi_.empty() ? nullptr : psi_.data() + first,
        .mu = mu_,
        .lambda = lambda_,
        .averaged = averaged_,
        .viscous = viscosity.over_step * mu_,
        .before = viscosity.before.empty() ? nullptr : viscosity.before.data() + 6 * first};
    energy += add_cell(cell, own.data(), strains.data(), with_forces ? forces.data() : nullptr);
  }
  return energy;
}

double FiniteBody::energy(std::span<const double> displacements, std::span<double> gradient,
                          Workspace& workspace, const Viscosity& viscosity) const {
  const bool with_forces = !gradient.empty();
  workspace.forces.resize(pieces_.size());
  workspace.energies.assign(pieces_.size(), 0.0);
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t p) {
    workspace.energies[p] =
        add_piece(pieces_[p], displacements, with_forces, viscosity, workspace.forces[p]);
  });
  double sum = 0.0;
  for (const double energy : workspace.energies) sum += energy;
  if (with_forces) {
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
      const std::vector<int>& nodes = pieces_[p].nodes;
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        double* to = gradient.data() + 3 * static_cast<std::size_t>(nodes[i]);
        const Quad& force = workspace.forces[p][i];
        for (int k = 0; k < 3; ++k) to[k] += force[k];
      }
    }
  }
  add_hold(displacements, gradient, sum);
  return sum;
}

void FiniteBody::add_hold(std::span<const double> displacements, std::span<double> gradient,
                          double& energy) const {
  std::vector<double> own(3 * hold_nodes_.size()), forces(own.size());
  for (std::size_t i = 0; i < hold_nodes_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      own[3 * i + k] = displacements[3 * static_cast<std::size_t>(hold_nodes_[i]) + k];
  hold_.multiply(own, forces);
  for (std::size_t i = 0; i < own.size(); ++i) energy += 0.5 * own[i] * forces[i];
  if (gradient.empty()) return;
  for (std::size_t i = 0; i < hold_nodes_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      gradient[3 * static_cast<std::size_t>(hold_nodes_[i]) + k] += forces[3 * i + k];
}

Mat3 FiniteBody::gradient_at(std::size_t point, const Piece& piece,
                             std::span<const double> displacements) const {
  Mat3 f = Mat3::Identity();
  for (std::size_t e = begin_[point]; e < begin_[point + 1]; ++e) {
    const auto node = static_cast<std::size_t>(piece.nodes[entry_nodes_[e]]);
    f += Vec3::Map(displacements.data() + 3 * node) * Vec3::Map(gradients_[e].data()).transpose();
  }
  return f;
}

Strains FiniteBody::strains(std::span<const double> displacements) const {
  Strains all(6 * points());
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t p) {
    const Piece& piece = pieces_[p];
    for (std::size_t q = cell_begin_[piece.first_cell]; q < cell_begin_[piece.last_cell]; ++q) {
      const Mat3 f = gradient_at(q, piece, displacements);
      const Mat3 e = 0.5 * (f.transpose() * f - Mat3::Identity());
      const double six[6] = {e(0, 0), e(1, 1), e(2, 2), e(0, 1), e(1, 2), e(2, 0)};
      std::copy(std::begin(six), std::end(six), all.begin() + static_cast<std::ptrdiff_t>(6 * q));
    }
  });
  return all;
}

double FiniteBody::volume(std::span<const double> displacements) const {
  double sum = 0.0;
  for (const Piece& piece : pieces_)
    for (std::size_t q = cell_begin_[piece.first_cell]; q < cell_begin_[piece.last_cell]; ++q)
      sum += weights_[q] * gradient_at(q, piece, displacements).determinant();
  return sum;
}

std::vector<Mat3> FiniteBody::mean_gradients(std::span<const double> displacements) const {
  std::vector<Mat3> of_cells(cells());
  parallel_for_each_index(pieces_.size(), 1, [&](std::size_t p) {
    for (std::size_t c = pieces_[p].first_cell; c < pieces_[p].last_cell; ++c) {
      Mat3 sum = Mat3::Zero();
      double volume = 0.0;
      for (std::size_t q = cell_begin_[c]; q < cell_begin_[c + 1]; ++q) {
        sum += weights_[q] * gradient_at(q, pieces_[p], displacements);
        volume += weights_[q];
      }
      of_cells[c] = sum / volume;
    }
  });
  std::vector<Mat3> of_nodes(nodes_, Mat3::Zero());
  for (std::size_t node = 0; node < nodes_; ++node)
    for (std::size_t i = share_begin_[node]; i < share_begin_[node + 1]; ++i)
      of_nodes[node] += shares_[i] * of_cells[static_cast<std::size_t>(share_cells_[i])];
  return of_nodes;
}

std::size_t FiniteBody::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t sum = of(cell_begin_) + of(weights_) + of(psi_) + of(begin_) + of(entry_nodes_) +
                    of(gradients_) + of(hold_.blocks) + of(hold_.pattern.columns) +
                    of(hold_nodes_) + of(share_begin_) + of(share_cells_) + of(shares_);
  for (const Piece& piece : pieces_) sum += of(piece.nodes);
  return sum;
}

}  // namespace viscera
