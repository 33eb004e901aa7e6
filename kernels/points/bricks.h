// Sparse bricks of a scalar field in an organ's rest space: what a burn or a cut does is finer than
// nodes, so it lives on voxels of some tenths of a millimetre, allocated only where something
// happens.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/points/brick_map.h"

namespace viscera {

/// 8 x 8 x 8 voxels a brick, values at voxel centres, float, zero where no brick is.
class BrickField {
 public:
  static constexpr int kEdge = 8;  ///< voxels along a brick
  static constexpr int kVoxels = kEdge * kEdge * kEdge;
  using Values = std::array<float, kVoxels>;  ///< x fastest
  using Index = BrickIndex;                   ///< of a brick or a voxel

  struct State {
    std::vector<Index> indices;  ///< of the bricks, in order of allocation
    std::vector<Values> values;  ///< of each
    static constexpr auto fields() {
      return std::tuple(field("indices", &State::indices), field("values", &State::values));
    }
  };

  /// `voxel` is the edge of a voxel [m]; voxel (0,0,0) spans [0, voxel)^3 of the rest frame.
  explicit BrickField(double voxel = 0.5e-3);

  double voxel() const { return voxel_; }
  std::size_t brick_count() const { return state_.values.size(); }
  const std::vector<Index>& brick_indices() const { return state_.indices; }
  const Values& brick(std::size_t i) const { return state_.values[i]; }
  Values& brick(std::size_t i) { return state_.values[i]; }

  /// The brick with this index, or -1.
  int find(const Index& brick) const { return lookup_.find(brick); }
  /// Finds or allocates (zeroed).
  std::size_t ensure(const Index& brick);
  /// Value of one voxel; 0 where no brick is.
  float at(const Index& voxel) const;
  /// Trilinear between voxel centres.
  double sample(const Vec3& rest_position) const;

  static Index brick_of(const Index& voxel);  ///< floor division by kEdge
  /// Which of its brick's values a voxel has; `brick`: brick_of() it.
  static int place_in_brick(const Index& voxel, const Index& brick) {
    const Index local = voxel - brick * kEdge;
    return local.x() + kEdge * (local.y() + kEdge * local.z());
  }
  Index voxel_of(const Vec3& rest_position) const;
  Vec3 centre(const Index& voxel) const { return (voxel.cast<double>().array() + 0.5) * voxel_; }
  std::size_t memory_bytes() const;

  const State& state() const { return state_; }
  void restore(State state);
  /// As many values as indices, each index once and one that a brick can have; all finite.
  static bool fits(const State& state);

 private:
  double voxel_;
  State state_;
  BrickMap lookup_;
};

static_assert(fields_cover<BrickField::State>());

}  // namespace viscera
