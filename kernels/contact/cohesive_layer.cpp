#include "kernels/contact/cohesive_layer.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

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
                              double radius) {
  const Vec3 first = normal.unitOrthogonal(), second = normal.cross(first);
  std::vector<Near> near;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Vec3 off = cells[c] - bond;
    const double share = 1.0 - off.squaredNorm() / (radius * radius);
    if (share > 0.0)
      near.push_back({static_cast<std::uint32_t>(c), share * share,
                      Vec3(1.0, off.dot(first) / radius, off.dot(second) / radius)});
  }
  return near;
}

std::uint32_t nearest(const Vec3& bond, std::span<const Vec3> cells) {
  const auto least = std::ranges::min_element(
      cells, {}, [&](const Vec3& cell) { return (cell - bond).squaredNorm(); });
  return static_cast<std::uint32_t>(least - cells.begin());
}

}  // namespace

BondShares bond_shares(std::span<const Vec3> bonds, std::span<const Vec3> normals,
                       std::span<const Vec3> cells, double radius) {
  BondShares shares;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::vector<Near> near = cells_about(bonds[b], normals[b], cells, radius);
    Mat3 moment = Mat3::Zero();
    for (const Near& one : near) moment += one.weight * one.place * one.place.transpose();
    const double spread = Eigen::SelfAdjointEigenSolver<Mat3>(moment).eigenvalues().minCoeff();
    if (near.size() >= 3 && spread > kFlattest * kFlattest * moment(0, 0)) {
      const Vec3 solved = moment.llt().solve(Vec3::UnitX());
      for (const Near& one : near) {
        shares.cells.push_back(one.cell);
        shares.values.push_back(one.weight * solved.dot(one.place));
      }
    } else {
      shares.cells.push_back(nearest(bonds[b], cells));
      shares.values.push_back(1.0);
    }
    shares.begin.push_back(static_cast<std::uint32_t>(shares.cells.size()));
  }
  return shares;
}

BondStates whole_bonds(const CohesiveLayer& layer) {
  return {std::vector<double>(layer.areas.size(), 0.0),
          std::vector<std::uint8_t>(layer.areas.size(), 0)};
}

bool holds(const CohesiveLayer& layer, const BondStates& states, std::size_t bond) {
  return states.burnt[bond] == 0 && layer.law.left(states.opened[bond]) > 0.0;
}

LayerInStep::LayerInStep(const CohesiveLayer& layer, const BondStates& before)
    : layer_(layer), before_(before), joint_of_(layer.cells, -1), opened_(before.opened) {
  std::vector<char> held(layer.cells, 0);
  for (std::size_t b = 0; b < layer.areas.size(); ++b) {
    left_.push_back(holds(layer, before, b) ? layer.law.left(opened_[b]) : 0.0);
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

void LayerInStep::assemble() {
  const auto count = static_cast<Eigen::Index>(joined_.size());
  MatrixX stiffness = MatrixX::Zero(count, count);
  VectorX ridge = VectorX::Zero(count);
  for (std::size_t b = 0; b < left_.size(); ++b) {
    const double whole = layer_.areas[b] * layer_.law.stiffness;
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
    left[b] = layer_.law.left(opened_[b]);
    greatest = std::max(greatest, std::abs(left[b] - left_[b]));
  }
  if (!(greatest > kSameStiffness)) return false;
  left_ = std::move(left);
  assemble();
  return true;
}

BondStates LayerInStep::after() const {
  return {opened_, before_.burnt};
}

}  // namespace viscera
