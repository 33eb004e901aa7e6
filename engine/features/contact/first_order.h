// Values over places about a tool's foot, to first order: of many cells or vertices nine numbers.
#pragma once

#include <span>

#include "kernels/base/types.h"
#include "kernels/contact/tissue_contact.h"
#include "kernels/hive/foot_hold.h"

namespace viscera {

/// value(x) = sum_i (1, a, b)_i coefficient_i with a and b the coordinates of x about the places'
/// mean, along two axes across the normal; by least squares.
class FirstOrder {
 public:
  /// At least one place [m]. Fewer than three, or on a line: the mean alone.
  FirstOrder(std::span<const Vec3> places, const Vec3& normal);

  /// The share of each place's value in each coefficient; 3 x places.
  const MatrixX& shares() const { return shares_; }

  /// The rigid motion nearest to x -> x + u(x) for displacements u of the places [m].
  Pose motion(std::span<const Vec3> displacements) const;

  /// What holds and strain take off the places' response, put together by the shares. Seen in the
  /// frame that `turn` takes to where the response was.
  FootHold hold(const OthersHold& others, const Quaternion& turn) const;

 private:
  Vec3 normal_, centre_ = Vec3::Zero(), along_x_, along_y_;
  double width_ = 0.0;
  MatrixX shares_;
};

/// The rotation nearest to a matrix, or none where that is singular or mirrors.
Quaternion nearest_rotation(const Mat3& matrix);

}  // namespace viscera
