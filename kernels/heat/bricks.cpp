#include "kernels/heat/bricks.h"

#include <cassert>
#include <cmath>

namespace viscera {
namespace {

// 21 bits a component: two million bricks each way, kilometres at half-millimetre voxels.
std::uint64_t key_of(const BrickField::Index& brick) {
  constexpr std::uint64_t mask = (std::uint64_t{1} << 21) - 1;
  const auto bits = [](int value) { return static_cast<std::uint64_t>(value) & mask; };
  return bits(brick.x()) | bits(brick.y()) << 21 | bits(brick.z()) << 42;
}

int floor_divide(int value, int by) {
  return value >= 0 ? value / by : -((by - 1 - value) / by);
}

}  // namespace

BrickField::BrickField(double voxel) : voxel_(voxel) {
  assert(voxel > 0.0);
}

int BrickField::find(const Index& brick) const {
  const auto found = lookup_.find(key_of(brick));
  return found == lookup_.end() ? -1 : found->second;
}

std::size_t BrickField::ensure(const Index& brick) {
  const auto [entry, inserted] =
      lookup_.try_emplace(key_of(brick), static_cast<int>(bricks_.size()));
  if (inserted) {
    indices_.push_back(brick);
    bricks_.emplace_back().fill(0.0f);
  }
  return static_cast<std::size_t>(entry->second);
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
  const std::size_t per_entry = sizeof(std::uint64_t) + sizeof(int) + 2 * sizeof(void*);
  return bricks_.capacity() * sizeof(Values) + indices_.capacity() * sizeof(Index) +
         lookup_.size() * per_entry + lookup_.bucket_count() * sizeof(void*);
}

}  // namespace viscera
