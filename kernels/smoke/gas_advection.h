// The gas carries its own momentum along: semi-Lagrangian, made second order by MacCormack's scheme
// [Selle2008].
#pragma once

#include "kernels/smoke/gas_layout.h"

namespace viscera {

/// Moves a velocity field on faces along itself; stable for any step, and no value leaves the range
/// of those that it comes from.
class GasAdvection {
 public:
  /// Faces with passes > 0 change, others keep their values [m/s]; dt [s]. Back along the flow by
  /// the midpoint rule, traced once a cell; MacCormack's correction is bounded by the values that
  /// it was interpolated from. Beyond the domain's sides the field goes on unchanged.
  void step(const GasLayout& layout, const GasFaces& passes, const Vec3& spacing, double dt,
            GasFaces& velocity);

 private:
  GasFaces moved_;  // by one step forward
  GasFaces result_;
  std::vector<float> way_[3];        // half of what gas of a cell has come along each axis [cells]
  std::vector<float> least_, most_;  // of the values that a face's is made of; one axis at a time
};

}  // namespace viscera
