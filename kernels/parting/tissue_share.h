// How much of an organ's tissue is left, place by place: what a blade has swept, scissors have
// sheared or heat has vaporised is gone. In the organ's shape at rest, in bricks of voxels, of
// which there are some only where something is gone.
//
// A voxel's share stands for its middle. By closed-form shapes it falls from 1 to 0 between a
// voxel's diagonal outside of them and as much inside, linearly with the distance, so that the
// places between voxels where half is left lie on the shape to a small part of a voxel.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

class TissueShare {
 public:
  using Voxel = std::array<int, 3>;

  /// Edge of a voxel [m].
  explicit TissueShare(double voxel);

  double voxel() const { return voxel_; }
  bool untouched() const { return bricks_.empty(); }
  Vec3 middle(const Voxel& voxel) const;

  /// Takes out where `distance` [m] is negative; it is asked within `reach` and two voxels about
  /// it. True: less is left somewhere. Parts thinner than least_kerf() may be missed.
  bool take_out(const Box& reach, const std::function<double(const Vec3&)>& distance);
  /// No more than this share is left of a voxel; true: that is less than before.
  bool limit(const Voxel& voxel, double share);

  double share(const Voxel& voxel) const;
  /// Of a place, linear between the middles of voxels.
  double share(const Vec3& place) const;
  std::size_t memory_bytes() const;

  /// The thinnest cut that surely leaves a way through: the middles of two voxels.
  double least_kerf() const { return 2.0 * voxel_; }

  static constexpr int kEdge = 8;  ///< of a brick, in voxels
  /// Lowest voxels of the bricks that have some, in their order.
  std::vector<Voxel> bricks() const;

 private:
  using Brick = std::array<float, kEdge * kEdge * kEdge>;
  static Voxel brick_of(const Voxel& voxel);
  static std::size_t within(const Voxel& voxel);

  double voxel_;
  std::map<Voxel, Brick> bricks_;  // by their numbers
};

}  // namespace viscera
