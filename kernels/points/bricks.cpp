#include "kernels/points/bricks.h"

#include <cassert>
#include <cmath>

namespace viscera {
BrickField::BrickField(double voxel) : voxel_(voxel) {
  assert(voxel > 0.0);
}

std::size_t BrickField::ensure(const Index& brick) {
  const int fresh = static_cast<int>(bricks_.size());
  const int number = lookup_.find_or_add(brick, fresh);
  if (number == fresh) {
    indices_.push_back(brick);
    bricks_.emplace_back().fill(0.0f);
  }
  return static_cast<std::size_t>(number);
}

float BrickField::at(const Index& voxel) const {
  const Index brick = brick_of(voxel);
  const int found = find(brick);
  if (found < 0) return 0.0f;
  const Index local = voxel - brick * kEdge;
  return bricks_[found][local.x() + kEdge * (local.y() + kEdge * local.z())];
}

double BrickField::sample(const Vec3& rest_position) const {
  const Vec3 scaled = rest_position / voxel_ - Vec3::Constant(0.5);
  const Vec3 floor = scaled.array().floor();
  const Vec3 t = scaled - floor;
  const Index base = floor.cast<int>();
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Index step(corner & 1, corner >> 1 & 1, corner >> 2);
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) weight *= step[axis] ? t[axis] : 1.0 - t[axis];
    value += weight * at(base + step);
  }
  return value;
}

BrickField::Index BrickField::brick_of(const Index& voxel) {
  return voxel.unaryExpr([](int value) { return floor_divide(value, kEdge); });
}

BrickField::Index BrickField::voxel_of(const Vec3& rest_position) const {
  return (rest_position / voxel_).array().floor().cast<int>();
}

std::size_t BrickField::memory_bytes() const {
  return bricks_.capacity() * sizeof(Values) + indices_.capacity() * sizeof(Index) +
         lookup_.memory_bytes();
}

}  // namespace viscera
