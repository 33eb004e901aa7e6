// The hand that holds a simulated device: where it wants to be, and how hard it holds on.
#pragma once

#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// A hand as the device feels it: a mass, tied to where the hand wants to be by a spring and a
/// damper. Orders of magnitude after [Hajian1997] and [Kuchenbecker2003], recalled.
struct Hand {
  double mass = 0.0;       ///< [kg] that moves with the handle
  double stiffness = 0.0;  ///< [N/m]
  double damping = 0.0;    ///< [N s/m]

  /// From 0, two fingertips that hardly hold, to 1, a fist. In between geometrically.
  static Hand with_grip(double grip);
};

/// Where the hand wants to be over time: key frames joined by movements of least jerk [Flash1985],
/// which rest at each key; or, where the keys are samples of a movement, by straight lines. Before
/// the first and after the last it rests there.
struct HandPath {
  bool sampled = false;
  struct Key {
    double time = 0.0;  ///< [s], rising
    Pose pose;
    std::uint32_t buttons = 0;  ///< held from here on
  };
  std::vector<Key> keys;

  struct At {
    Pose pose;
    Vec3 velocity = Vec3::Zero();  ///< [m/s]
    std::uint32_t buttons = 0;
  };
  At at(double time) const;
};

}  // namespace viscera
