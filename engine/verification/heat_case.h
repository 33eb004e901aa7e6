// What benchmarks of heat heat, on the CPU or on a device, and how far two of them are apart.
#pragma once

#include <memory>

#include "engine/verification/heat_solutions.h"

namespace viscera {

/// A cube of warm, half-cooked tissue with blood under a surface, of so many bricks along its edge;
/// its middle boils.
class HeatCase {
 public:
  static constexpr double kStep = 1.0 / 60.0;  ///< [s]

  explicit HeatCase(int edge_bricks, std::shared_ptr<HeatPasses> passes = nullptr,
                    HeatReturn fields = HeatReturn::kEveryStep);
  /// Its sources are put in; then heat().step(kStep).
  void heat_middle();
  Bioheat& heat() { return heat_; }
  const Bioheat& heat() const { return heat_; }

 private:
  Bioheat heat_;
  Vec3 middle_;
};

/// Greatest error where a Gaussian source has warmed tissue by 15 to 35 K after three seconds, to
/// about 60 C as at a lesion's edge; over the rise there.
double lesion_edge_error(double voxel, double dt, std::shared_ptr<HeatPasses> passes = nullptr);

/// Greatest differences between two organs' bricks.
struct HeatDifference {
  bool same_bricks = false;  ///< else nothing else is told
  double excess = 0.0;       ///< over the greatest excess there is
  double water = 0.0;        ///< of what a voxel holds wet
  double charred = 0.0;      ///< of its solids
  /// Of dose, coagulation and collagen: over the value, or a thousandth where that is less.
  double damage = 0.0;
};
HeatDifference heat_difference(const Bioheat& a, const Bioheat& b);

}  // namespace viscera
