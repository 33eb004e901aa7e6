// The compliance among the few places that cells touch, gathered from its long columns.
#pragma once

#include <array>
#include <vector>

#include "kernels/paff/elasticity.h"

namespace viscera {

class TouchedCompliance {
 public:
  /// Components xx, xy, xz, yx, ..., (touched) x (touched) each; yx, zx and zy stay empty where it
  /// is symmetric, being the transposes of xy, xz and yz.
  using Parts = std::array<Eigen::MatrixXf, 9>;

  /// Of these touchable places, ascending, whose columns are made. What was read for places that
  /// are still touched is kept. False: they are the same as before.
  bool gather(const SurfaceCompliance& compliance, const std::vector<int>& touched);

  const Parts& parts() const { return parts_; }
  std::size_t memory_bytes() const;

 private:
  std::vector<int> touched_;
  Parts parts_;
};

}  // namespace viscera
