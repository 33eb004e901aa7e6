// A part of space.
#pragma once

#include "kernels/base/types.h"

namespace viscera {

/// Of an organ's: in its own frame, before its pose.
struct Region {
  enum class Shape { kHalfSpace, kSphere, kBox };
  Shape shape = Shape::kHalfSpace;
  Vec3 a = Vec3::Zero();   ///< point of the plane, centre, least corner [m]
  Vec3 b = Vec3::UnitZ();  ///< normal (inside where (x-a).b <= 0), unused, greatest corner
  double radius = 0.0;     ///< of the sphere [m]

  bool contains(const Vec3& x) const;
  /// The same with its border moved out by `margin` [m].
  Region grown(double margin) const;
};

}  // namespace viscera
