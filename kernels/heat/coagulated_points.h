// What heat has made of tissue, gathered at the points where a body's elasticity is integrated.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/heat/heat_bricks.h"
#include "kernels/points/kd_tree.h"

namespace viscera {

/// Means over the tissue about each point.
struct CoagulatedPoints {
  std::vector<double> stiffness;  ///< Young's modulus over sound tissue's, at least 1          (Q)
  std::vector<double> shrinkage;  ///< share of a length that is lost                           (Q)
  double greatest_stiffness = 1.0;
  double stiffened = 0.0;  ///< tissue that is at least half as stiff again [m3]
  double left_out = 0.0;   ///< tissue like that, but with no point near [m3]
};

/// Voxels are finer than the points, so nothing may fall between these: what a voxel has become
/// counts at the point nearest to it, averaged over the volume that the point stands for. Which
/// points these are is remembered for each brick; a gauge made anew reads the same.
class CoagulationGauge {
 public:
  /// Rest positions and the volumes that they stand for [m3].
  CoagulationGauge(std::span<const Vec3> positions, std::span<const double> volumes);

  /// The bricks' tissue has this share of water by mass when sound. The same for any number of
  /// threads.
  CoagulatedPoints read(const HeatBricks& bricks, double water_fraction);

  std::size_t memory_bytes() const;

 private:
  using Nearest = std::array<std::int32_t, BrickField::kVoxels>;  // -1: none near

  const Nearest& nearest_points(const HeatBricks& bricks, const HeatBrick& brick);

  KdTree tree_;
  std::vector<double> volumes_;
  double mean_volume_ = 0.0;
  BrickMap numbers_;
  std::vector<Nearest> nearest_;
};

}  // namespace viscera
