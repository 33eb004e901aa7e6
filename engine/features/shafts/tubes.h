// Instruments as tubes that bend: where two of them are nearest, and what holds them apart.
#pragma once

#include <optional>

#include "kernels/base/types.h"

namespace viscera {

/// From an instrument's tip to its trocar, or the endoscope's barrel from its lens backwards;
/// world.
struct Tube {
  Vec3 tip = Vec3::Zero();    ///< [m]
  Vec3 pivot = Vec3::Zero();  ///< where what is beyond holds it [m]
  double radius = 0.0;        ///< [m]
};

/// Where the axes of two are nearest.
struct TubesNearest {
  Vec3 on_one = Vec3::Zero(), on_other = Vec3::Zero();  ///< [m]
  /// Unit, across both, of two that cross each other between their ends; nothing: an end is
  /// nearest, or they are parallel.
  std::optional<Vec3> across;
};
TubesNearest nearest(const Tube& one, const Tube& other);

/// Force at a place of its axis over how far it gives way there [N/m]: a clamped beam from its
/// pivot, 3 E I / l^3, a steel tube (193 GPa, recalled) whose wall is a fifth of its radius
/// (chosen), no more than kStiffestTube.
double bending_stiffness(const Tube& tube, const Vec3& at);
/// Near its pivot a tube is stiffer than a hand can be shown; chosen [N/m].
inline constexpr double kStiffestTube = 5000.0;

}  // namespace viscera
