#include "kernels/points/bricks.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace viscera {
BrickField::BrickField(double voxel) : voxel_(voxel) {
  assert(voxel > 0.0);
}

std::size_t BrickField::ensure(const Index& brick) {
  const int fresh = static_cast<int>(state_.values.size());
  const int number = lookup_.find_or_add(brick, fresh);
  if (number == fresh) {
    state_.indices.push_back(brick);
    state_.values.emplace_back().fill(0.0f);
  }
  return static_cast<std::size_t>(number);
}

float BrickField::at(const Index& voxel) const {
  const Index brick = brick_of(voxel);
  const int found = find(brick);
  if (found < 0) return 0.0f;
  return state_.values[static_cast<std::size_t>(found)]
                      [static_cast<std::size_t>(place_in_brick(voxel, brick))];
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

void BrickField::restore(State state) {
  state_ = std::move(state);
  lookup_ = {};
  for (std::size_t b = 0; b < state_.indices.size(); ++b)
    lookup_.set(state_.indices[b], static_cast<int>(b));
}

bool BrickField::fits(const State& state) {
  if (state.indices.size() != state.values.size()) return false;
  BrickMap seen;
  for (std::size_t b = 0; b < state.indices.size(); ++b)
    if (!BrickMap::holds(state.indices[b]) ||
        seen.find_or_add(state.indices[b], static_cast<int>(b)) != static_cast<int>(b) ||
        !std::ranges::all_of(state.values[b], [](float value) { return std::isfinite(value); }))
      return false;
  return true;
}

std::size_t BrickField::memory_bytes() const {
  return state_.values.capacity() * sizeof(Values) + state_.indices.capacity() * sizeof(Index) +
         lookup_.memory_bytes();
}

}  // namespace viscera
