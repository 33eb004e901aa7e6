// The two balls that benchmarks and tests of touching organs share.
#pragma once

#include "engine/scene/scene.h"

namespace viscera {

/// When the upper ball is as low as it goes [s].
inline constexpr double kBallsNearest = 0.5;

/// What touches is the drawn surface: flat triangles, and patches of it.
struct BallFineness {
  double edge = 2.5e-3;  ///< of its triangles [m]
  double pitch = 0.5;    ///< TouchingDescription::pitch
};

/// Two balls of 25 mm radius, tissue "rubber", that touch at the pole: the lower about the origin,
/// the upper above it; each held in its half away from the other, nodes 6 mm apart and 3 mm about
/// the poles. The upper one goes down by `approach` [m] and back within 2 kBallsNearest.
SceneDescription touching_balls(double approach, Response response,
                                const BallFineness& fineness = {});

}  // namespace viscera
