// Which brick of a sparse field has which index.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "kernels/base/types.h"

namespace viscera {

/// Integers of a brick or a voxel; may be negative.
using BrickIndex = Eigen::Vector3i;

/// From the indices of bricks to small numbers that their owner chose.
class BrickMap {
 public:
  static constexpr int kNone = -1;

  /// Indices beyond these would be taken for others.
  static bool holds(const BrickIndex& brick) {
    return brick.minCoeff() >= -(1 << 20) && brick.maxCoeff() < 1 << 20;
  }

  int find(const BrickIndex& brick) const {
    const auto found = numbers_.find(key_of(brick));
    return found == numbers_.end() ? kNone : found->second;
  }
  /// The number that the brick already had, or `fresh`, which it has from now on.
  int find_or_add(const BrickIndex& brick, int fresh) {
    return numbers_.try_emplace(key_of(brick), fresh).first->second;
  }
  void set(const BrickIndex& brick, int number) { numbers_[key_of(brick)] = number; }
  void erase(const BrickIndex& brick) { numbers_.erase(key_of(brick)); }
  std::size_t memory_bytes() const {
    const std::size_t per_entry = sizeof(std::uint64_t) + sizeof(int) + 2 * sizeof(void*);
    return numbers_.size() * per_entry + numbers_.bucket_count() * sizeof(void*);
  }

 private:
  // 21 bits a component: two million bricks each way, kilometres at half-millimetre voxels.
  static std::uint64_t key_of(const BrickIndex& brick) {
    constexpr std::uint64_t mask = (std::uint64_t{1} << 21) - 1;
    const auto bits = [](int value) { return static_cast<std::uint64_t>(value) & mask; };
    return bits(brick.x()) | bits(brick.y()) << 21 | bits(brick.z()) << 42;
  }

  std::unordered_map<std::uint64_t, int> numbers_;
};

/// Calls for each brick of this edge [m] that meets the box.
template <class Body>
void for_bricks_in(const Box& box, double edge, const Body& body) {
  const BrickIndex first = (box.min() / edge).array().floor().cast<int>();
  const BrickIndex last = (box.max() / edge).array().floor().cast<int>();
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x)
        if (const BrickIndex index(x, y, z); BrickMap::holds(index)) body(index);
}

/// Division that rounds down.
inline int floor_divide(int value, int by) {
  return value >= 0 ? value / by : -((by - 1 - value) / by);
}

}  // namespace viscera
