#include "kernels/contact/cohesive_layer.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace viscera {
namespace {

/// A bond's stiffness that has changed by less than this share of a whole one's is as it was.
constexpr double kSameStiffness = 2e-3;
/// Of a cell's stiffness while its bonds are whole, added: cells whose bonds part within a step
/// still have a softness.
constexpr double kRidge = 1e-6;
/// Cells about a bond that lie along a line say nothing of what is across it.
constexpr double kFlattest = 0.05;

struct Near {
  std::uint32_t cell = 0;
  double weight = 0.0;
  Vec3 place = Vec3::Zero();  // 1, and along the surface, in radii
};

std::vector<Near> cells_about(const Vec3& bond, const Vec3& normal, std::span<const Vec3> cells,
                              double radius, const std::function<bool(std::size_t)>& joins) {
  const Vec3 first = normal.unitOrthogonal(), second = normal.cross(first);
  std::vector<Near> near;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Vec3 off = cells[c] - bond;
    const double share = 1.0 - off.squaredNorm() / (radius * radius);
    if (share > 0.0 && joins(c))
      near.push_back({static_cast<std::uint32_t>(c), share * share,
                      Vec3(1.0, off.dot(first) / radius, off.dot(second) / radius)});
  }
  return near;
}

/// None: no cell joins.
std::optional<std::uint32_t> nearest(const Vec3& bond, std::span<const Vec3> cells,
                                     const std::function<bool(std::size_t)>& joins) {
  std::optional<std::uint32_t> found;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const double away = (cells[c] - bond).squaredNorm();
    if (!(away < least) || !joins(c)) continue;
    least = away;
    found = static_cast<std::uint32_t>(c);
  }
  return found;
}

}  // namespace

BondShares bond_shares(std::span<const Vec3> bonds, std::span<const Vec3> normals,
                       std::span<const Vec3> cells, double radius,
                       const std::function<bool(std::size_t, std::size_t)>& joins) {
  BondShares shares;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const auto counts = [&](std::size_t cell) { return !joins || joins(b, cell); };
    const std::vector<Near> near = cells_about(bonds[b], normals[b], cells, radius, counts);
    Mat3 moment = Mat3::Zero();
    for (const Near& one : near) moment += one.weight * one.place * one.place.transpose();
    const double spread = Eigen::SelfAdjointEigenSolver<Mat3>(moment).eigenvalues().minCoeff();
    if (near.size() >= 3 && spread > kFlattest * kFlattest * moment(0, 0)) {
      const Vec3 solved = moment.llt().solve(Vec3::UnitX());
      for (const Near& one : near) {
        shares.cells.push_back(one.cell);
        shares.values.push_back(one.weight * solved.dot(one.place));
      }
    } else if (const auto one = nearest(bonds[b], cells, counts)) {
      shares.cells.push_back(*one);
      shares.values.push_back(1.0);
    }
    shares.begin.push_back(static_cast<std::uint32_t>(shares.cells.size()));
  }
  return shares;
}

double CohesiveLayer::stiffness(std::size_t bond, double opened) const {
  double sum = areas[bond] * law.stiffness * law.left(opened);
  if (const double length = edge(bond); length > 0.0)
    sum += length * film.stiffness * film.left(opened);
  return sum;
}

double CohesiveLayer::spent(std::size_t bond, double opened) const {
  double sum = areas[bond] * law.spent(opened);
  if (const double length = edge(bond); length > 0.0) sum += length * film.spent(opened);
  return sum;
}

std::vector<double> layer_edges(std::span<const Vec3> bonds, std::span<const Vec3> normals,
                                std::span<const double> areas, double radius) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  std::vector<double> edges(bonds.size(), 0.0);
  std::vector<double> around;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const Vec3 first = normals[b].unitOrthogonal(), second = normals[b].cross(first);
    around.clear();
    for (std::size_t c = 0; c < bonds.size(); ++c) {
      const Vec3 off = bonds[c] - bonds[b];
      if (c != b && off.squaredNorm() < radius * radius)
        around.push_back(std::atan2(off.dot(second), off.dot(first)));
    }
    std::ranges::sort(around);
    double widest = around.empty() ? kTurn : kTurn + around.front() - around.back();
    for (std::size_t i = 0; i + 1 < around.size(); ++i)
      widest = std::max(widest, around[i + 1] - around[i]);
    if (widest > kTurn / 3.0) edges[b] = std::sqrt(areas[b]);
  }
  return edges;
}

BondStates whole_bonds(const CohesiveLayer& layer) {
  return {std::vector<double>(layer.areas.size(), 0.0),
          std::vector<std::uint8_t>(layer.areas.size(), 0)};
}

bool holds(const CohesiveLayer& layer, const BondStates& states, std::size_t bond) {
  return states.parted_by[bond] == 0 && layer.stiffness(bond, states.opened[bond]) > 0.0;
}

LayerInStep::LayerInStep(const CohesiveLayer& layer, const BondStates& before)
    : layer_(layer), before_(before), joint_of_(layer.cells, -1), opened_(before.opened) {
  std::vector<char> held(layer.cells, 0);
  for (std::size_t b = 0; b < layer.areas.size(); ++b) {
    left_.push_back(holds(layer, before, b) ? left_of(b) : 0.0);
    if (left_[b] == 0.0) continue;
    for (std::uint32_t e = layer.shares.begin[b]; e < layer.shares.begin[b + 1]; ++e)
      held[layer.shares.cells[e]] = 1;
  }
  for (std::size_t c = 0; c < layer.cells; ++c) {
    if (!held[c]) continue;
    joint_of_[c] = static_cast<int>(joined_.size());
    joined_.push_back(c);
  }
  assemble();
}

double LayerInStep::left_of(std::size_t bond) const {
  return layer_.stiffness(bond, opened_[bond]) / layer_.stiffness(bond, 0.0);
}

void LayerInStep::assemble() {
  const auto count = static_cast<Eigen::Index>(joined_.size());
  MatrixX stiffness = MatrixX::Zero(count, count);
  VectorX ridge = VectorX::Zero(count);
  for (std::size_t b = 0; b < left_.size(); ++b) {
    const double whole = layer_.stiffness(b, 0.0);
    for (std::uint32_t e = layer_.shares.begin[b]; e < layer_.shares.begin[b + 1]; ++e) {
      const int row = joint_of_[layer_.shares.cells[e]];
      if (row < 0) continue;
      ridge[row] += kRidge * std::abs(layer_.shares.values[e]) * whole;
      if (left_[b] == 0.0) continue;
      for (std::uint32_t f = layer_.shares.begin[b]; f < layer_.shares.begin[b + 1]; ++f)
        stiffness(row, joint_of_[layer_.shares.cells[f]]) +=
            left_[b] * whole * layer_.shares.values[e] * layer_.shares.values[f];
    }
  }
  stiffness.diagonal() += ridge;
  softness_ = stiffness.llt().solve(MatrixX::Identity(count, count));
  softness_ = (0.5 * (softness_ + softness_.transpose())).eval();
}

bool LayerInStep::follow(std::span<const Vec3> apart) {
  double greatest = 0.0;
  std::vector<double> left(left_.size(), 0.0);
  for (std::size_t b = 0; b < left_.size(); ++b) {
    if (!holds(layer_, before_, b)) continue;
    Vec3 open = Vec3::Zero();
    for (std::uint32_t e = layer_.shares.begin[b]; e < layer_.shares.begin[b + 1]; ++e)
      open += layer_.shares.values[e] *
              apart[static_cast<std::size_t>(joint_of_[layer_.shares.cells[e]])];
    opened_[b] = std::max(before_.opened[b], open.norm());
    left[b] = left_of(b);
    greatest = std::max(greatest, std::abs(left[b] - left_[b]));
  }
  if (!(greatest > kSameStiffness)) return false;
  left_ = std::move(left);
  assemble();
  return true;
}

BondStates LayerInStep::after() const {
  return {opened_, before_.parted_by};
}

}  // namespace viscera
