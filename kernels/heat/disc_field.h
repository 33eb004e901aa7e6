// The field of current that enters a half-space through a disc, spread over voxels and shells.
#pragma once

#include <array>
#include <vector>

#include "kernels/points/bricks.h"

namespace viscera {

/// The potential in uniform tissue is a function of u = atan(zeta) alone, zeta the oblate
/// coordinate of the half-ellipsoids about the disc, from 0 on the disc to pi/2 far away
/// [Newman1966]. Shells are equal steps of u; over a shell of thickness du, |grad u|^2 integrates
/// to 2 pi radius du. Of the innermost about a quarter is missing, at the rim, where no sampling is
/// fine enough: some percent of the resistance.
class DiscField {
 public:
  static constexpr int kMostShells = 16;
  /// |grad u|^2 integrated over a voxel's part of each shell [m].
  using Shares = std::array<float, kMostShells>;

  /// Of a disc at `point`, facing into the tissue against `outward`, up to `reach` away.
  DiscField(const Vec3& point, const Vec3& outward, double radius, double reach, double voxel);

  double radius() const { return radius_; }
  int shells() const { return shells_; }
  double shell() const { return shell_; }           ///< thickness in u
  double last() const { return shell_ * shells_; }  ///< u where the last shell ends

  /// Of eight voxels in a row along x, the first one's middle at `first`; none beyond `reach`.
  /// False if all are.
  bool share_row(const Vec3& first, std::array<Shares, BrickField::kEdge>& shares) const;

 private:
  /// Middles of a voxel's parts from its own, in lengths of the radius; eights of them.
  struct Samples {
    float part = 0.0f;  ///< their edge
    std::array<std::vector<float>, 3> place;
    std::vector<float> weight;
  };
  static Samples samples_of(int edge, double size);

  Vec3 point_;
  double radius_, reach_, voxel_;
  int shells_ = 0;
  double shell_ = 0.0;
  std::array<float, 3> outward_{};
  Samples fine_, coarse_;
};

}  // namespace viscera
