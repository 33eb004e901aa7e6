#include "kernels/finite/grip_touch.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "kernels/finite/warped_factor.h"

namespace viscera {
namespace {

/// Keeps the response from being singular where points are held closer than nodes.
constexpr double kShift = 1e-7;

}  // namespace

void HeldRows::add(std::span<const int> point_nodes, std::span<const double> point_values) {
  nodes.insert(nodes.end(), point_nodes.begin(), point_nodes.end());
  values.insert(values.end(), point_values.begin(), point_values.end());
  begin.push_back(nodes.size());
}

GripTouch::GripTouch(const Grip& grip, std::span<const Vec3> displacements,
                     std::span<const Vec3> last)
    : grip_(grip), wanted_(3 * static_cast<Eigen::Index>(grip.rows.points())) {
  for (std::size_t p = 0; p < cells(); ++p)
    wanted_.segment<3>(static_cast<Eigen::Index>(3 * p)) = displacements[p];
  if (last.size() != cells()) return;
  last_.resize(wanted_.size());
  for (std::size_t p = 0; p < cells(); ++p)
    last_.segment<3>(static_cast<Eigen::Index>(3 * p)) = last[p];
}

/// Y = R P^-1 Phi^T R_grip^T, and Phi Y.
void GripTouch::turn(const NodalRotations& rotations) {
  const Mat3 own = rotation_of(rotations, static_cast<std::size_t>(grip_.rows.nodes.front()));
  columns_.resize(grip_.columns.rows(), grip_.columns.cols());
  for (Eigen::Index p = 0; p < columns_.cols(); p += 3)
    for (Eigen::Index at = 0; at < columns_.rows(); at += 3)
      columns_.block<3, 3>(at, p) = rotation_of(rotations, static_cast<std::size_t>(at / 3)) *
                                    grip_.columns.block<3, 3>(at, p) * own.transpose();
  response_.resize(columns_.cols(), columns_.cols());
  for (Eigen::Index c = 0; c < columns_.cols(); ++c) response_.col(c) = displaced(columns_.col(c));
  response_ = (0.5 * (response_ + response_.transpose())).eval();
}

VectorX GripTouch::displaced(const VectorX& u) const {
  const HeldRows& rows = grip_.rows;
  VectorX at = VectorX::Zero(wanted_.size());
  for (std::size_t p = 0; p < cells(); ++p)
    for (std::size_t e = rows.begin[p]; e < rows.begin[p + 1]; ++e)
      at.segment<3>(static_cast<Eigen::Index>(3 * p)) +=
          rows.values[e] * u.segment<3>(3 * static_cast<Eigen::Index>(rows.nodes[e]));
  return at;
}

void GripTouch::add_loads(const VectorX& forces, VectorX& loads) const {
  const HeldRows& rows = grip_.rows;
  for (std::size_t p = 0; p < cells(); ++p)
    for (std::size_t e = rows.begin[p]; e < rows.begin[p + 1]; ++e)
      loads.segment<3>(3 * static_cast<Eigen::Index>(rows.nodes[e])) +=
          rows.values[e] * forces.segment<3>(static_cast<Eigen::Index>(3 * p));
}

double GripTouch::begin(const VectorX& displaced) {
  begun_ = displaced;
  double most = 0.0;
  for (Eigen::Index at = 0; at < begun_.size(); at += 3) {
    const double way = (wanted_.segment<3>(at) - begun_.segment<3>(at)).norm();
    if (!(way <= most)) most = way;  // what isn't finite stays
  }
  return most;
}

std::optional<VectorX> GripTouch::solve(const TouchQuestion& question) {
  MatrixX rows = response_;
  if (question.more.size() > 0) rows += question.more;
  rows.diagonal().array() += kShift * rows.trace() / static_cast<double>(rows.rows());
  return rows.ldlt().solve(begun_ + question.share * (wanted_ - begun_) - question.free);
}

}  // namespace viscera
