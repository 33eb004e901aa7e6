// How much of an organ's tissue is left, place by place: what a blade has swept, scissors have
// sheared or heat has vaporised is gone. In the organ's shape at rest, in bricks of voxels, of
// which there are some only where something is gone.
//
// A voxel's share stands for its middle. By closed-form shapes it falls from 1 to 0 between a
// voxel's diagonal outside of them and as much inside, linearly with the distance, so that the
// places between voxels where half is left lie on the shape to a small part of a voxel.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "kernels/points/bricks.h"

namespace viscera {

class TissueShare {
 public:
  using Voxel = BrickField::Index;
  using State = BrickField::State;

  /// Edge of a voxel [m].
  explicit TissueShare(double voxel) : gone_(voxel) {}

  double voxel() const { return gone_.voxel(); }
  bool untouched() const { return gone_.brick_count() == 0; }
  Vec3 middle(const Voxel& voxel) const { return gone_.centre(voxel) + shift(); }
  Voxel voxel_of(const Vec3& place) const { return gone_.voxel_of(place - shift()); }

  /// Takes out where `distance` [m] is negative; it is asked within `reach` and two voxels about
  /// it. What has gone by this [m3]. Parts thinner than least_kerf() may be missed.
  double take_out(const Box& reach, const std::function<double(const Vec3&)>& distance);
  /// What taking out a plate takes of it, over the plate's area [m]: shares fall off across its
  /// faces.
  double taken_by_plate(double thickness) const;
  /// No more than this share is left of a voxel; what has gone by this, of all of it.
  double limit(const Voxel& voxel, double share);

  /// No more is left anywhere than of that, which has the same voxels.
  void limit_by(const TissueShare& other);

  double share(const Voxel& voxel) const { return 1.0 - static_cast<double>(gone_.at(voxel)); }
  /// Of a place, linear between the middles of voxels.
  double share(const Vec3& place) const { return 1.0 - gone_.sample(place - shift()); }

  /// The thinnest cut that surely leaves a way through: the middles of two voxels.
  double least_kerf() const { return 2.0 * voxel(); }

  static constexpr int kEdge = BrickField::kEdge;  ///< of a brick, in voxels
  /// Lowest voxels of the bricks that have some, in the order in which they came.
  std::vector<Voxel> bricks() const;

  const State& state() const { return gone_.state(); }
  void restore(State state) { gone_.restore(std::move(state)); }
  static bool fits(const State& state);  ///< shares are between none and all

 private:
  /// From the field's frame to the organ's: planes at round coordinates pass through no middle.
  Vec3 shift() const { return voxel() * Vec3(0.18301, 0.31415, 0.27182); }

  BrickField gone_;  // shares that are gone
};

}  // namespace viscera
