#include "kernels/heat/lesion.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

constexpr double kFarthest = 20e-3;  // [m]
constexpr double kFaint = 1e-9;      // Omega that counts as none

double log_damage(const Bioheat& heat, const Vec3& at) {
  const Vec3 scaled = at / heat.options().voxel - Vec3::Constant(0.5);
  const Vec3 floor = scaled.array().floor();
  const Vec3 t = scaled - floor;
  const BrickIndex base = floor.cast<int>();
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const BrickIndex step(corner & 1, corner >> 1 & 1, corner >> 2);
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) weight *= step[axis] ? t[axis] : 1.0 - t[axis];
    if (weight > 0.0)
      value += weight * std::log(std::max(kFaint, heat.bricks().damage_at(base + step)));
  }
  return value;
}

// How far from `from` along `way` the logarithm stays above `least`.
double extent(const Bioheat& heat, const Vec3& from, const Vec3& way, double least) {
  const double step = 0.05 * heat.options().voxel;
  double last = log_damage(heat, from);
  if (!(last >= least)) return 0.0;
  for (double x = step; x < kFarthest; x += step) {
    const double now = log_damage(heat, from + x * way);
    if (now < least) return x - step * (least - now) / std::max(1e-12, last - now);
    last = now;
  }
  return kFarthest;
}

}  // namespace

Lesion lesion_at(const Bioheat& heat, const Vec3& point, const Vec3& outward, double damage) {
  const double least = std::log(damage);
  // The outermost voxels' middles: nothing lies beyond to interpolate with.
  const double skin = 0.5 * heat.options().voxel;
  const Vec3 start = point - skin * outward;
  Lesion lesion;
  lesion.depth = extent(heat, start, -outward, least);
  if (lesion.depth > 0.0) lesion.depth += skin;
  const Vec3 side = outward.unitOrthogonal();
  lesion.width = extent(heat, start, side, least) + extent(heat, start, -side, least);
  return lesion;
}

}  // namespace viscera
