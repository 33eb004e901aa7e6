#include "engine/features/contact/first_order.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

/// A fit with less spread across the foot than this, over that along it, knows no slope there.
constexpr double kLeastSpread = 1e-3;
/// Holds count out to so many times the width of the places that they were found at.
constexpr double kHoldReach = 2.0;

/// The lesser eigenvalue over the greater.
double flatness(const Eigen::Matrix2d& spread) {
  const double half = 0.5 * spread.trace();
  const double off = std::hypot(0.5 * (spread(0, 0) - spread(1, 1)), spread(0, 1));
  return half + off > 0.0 ? (half - off) / (half + off) : 0.0;
}

using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// R and signs S with R S R^T = `whole`, symmetric. Where that is positive but for rounding:
/// Cholesky's, the greatest pivot first, until nothing is left.
void take_root(const Matrix9& whole, FootHold& hold) {
  constexpr double kLeast = 1e-14, kLeft = 1e-12;
  const double least = kLeast * whole.trace();
  Matrix9 rest = whole;
  hold.root.setZero();
  for (Eigen::Index r = 0; r < 9; ++r) {
    Eigen::Index pivot = 0;
    const double most = rest.diagonal().maxCoeff(&pivot);
    if (!(most > least)) break;
    hold.root.col(r) = rest.col(pivot) / std::sqrt(most);
    rest -= hold.root.col(r) * hold.root.col(r).transpose();
  }
  if (rest.norm() <= kLeft * whole.norm()) return;
  const Eigen::SelfAdjointEigenSolver<Matrix9> modes(whole);
  const FootHold::Vector9 amounts = modes.eigenvalues().cwiseAbs().cwiseSqrt();
  hold.root = modes.eigenvectors() * amounts.asDiagonal();
  hold.given = static_cast<int>((modes.eigenvalues().array() < 0.0).count());  // they ascend
}

}  // namespace

FirstOrder::FirstOrder(std::span<const Vec3> places, const Vec3& normal)
    : normal_(normal.normalized()) {
  for (const Vec3& place : places) centre_ += place;
  centre_ /= static_cast<double>(places.size());
  along_x_ = normal_.unitOrthogonal();
  along_y_ = normal_.cross(along_x_);
  const auto n = static_cast<Eigen::Index>(places.size());
  MatrixX basis(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vec3 off = places[static_cast<std::size_t>(k)] - centre_;
    basis.row(k) << 1.0, off.dot(along_x_), off.dot(along_y_);
    width_ = std::max(width_, off.norm());
  }
  const Mat3 gram = basis.transpose() * basis;
  shares_ = MatrixX::Zero(3, n);
  if (n >= 3 && flatness(gram.bottomRightCorner<2, 2>()) > kLeastSpread)
    shares_ = gram.inverse() * basis.transpose();
  else
    shares_.row(0).setConstant(1.0 / static_cast<double>(n));
}

Pose FirstOrder::motion(std::span<const Vec3> displacements) const {
  Mat3 coefficients = Mat3::Zero();  // a column each
  for (std::size_t k = 0; k < displacements.size(); ++k)
    coefficients += displacements[k] * shares_.col(static_cast<Eigen::Index>(k)).transpose();
  Mat3 rest, moved;
  rest << along_x_, along_y_, normal_;
  moved.col(0) = along_x_ + coefficients.col(1);
  moved.col(1) = along_y_ + coefficients.col(2);
  moved.col(2) = moved.col(0).cross(moved.col(1)).normalized();
  Pose pose;
  pose.orientation = nearest_rotation(moved * rest.transpose());
  pose.position = centre_ + coefficients.col(0) - pose.orientation * centre_;
  return pose;
}

FootHold FirstOrder::hold(const OthersHold& others, const Quaternion& turn) const {
  const MatrixX& taken = others.taken;
  const Mat3 back = turn.toRotationMatrix().transpose();
  const auto turned_back = [&](const MatrixX& whole) {
    Matrix9 result;
    for (Eigen::Index c = 0; c < 3; ++c)
      for (Eigen::Index d = 0; d < 3; ++d)
        result.block<3, 3>(3 * c, 3 * d) =
            back * whole.block<3, 3>(3 * c, 3 * d) * back.transpose();
    return result;
  };
  const Matrix9 turned = turned_back(taken);
  FootHold hold;
  if (!turned.allFinite()) return hold;
  take_root(0.5 * (turned + turned.transpose()), hold);
  hold.centre = centre_;
  hold.along_x = along_x_;
  hold.along_y = along_y_;
  hold.reach = kHoldReach * width_;
  if (others.stiffer.size() == 3) hold.stiffer = others.stiffer;
  if (others.divided.size() > 0) hold.divided = FootHold::slopes_of(turned_back(others.divided));
  hold.least = others.least;
  hold.most = others.most;
  return hold;
}

// [Higham1986]: R -> (R + R^-T) / 2, from which it converges quadratically.
Quaternion nearest_rotation(const Mat3& matrix) {
  constexpr int kSteps = 30;
  constexpr double kTolerance = 1e-14;
  if (!matrix.allFinite() || !(matrix.determinant() > 0.0)) return Quaternion::Identity();
  Mat3 turn = matrix;
  for (int i = 0; i < kSteps; ++i) {
    const Mat3 next = 0.5 * (turn + turn.inverse().transpose());
    const double change = (next - turn).norm();
    turn = next;
    if (!(change > kTolerance)) break;
  }
  return turn.allFinite() ? Quaternion(turn).normalized() : Quaternion::Identity();
}

}  // namespace viscera
