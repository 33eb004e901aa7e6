#include "kernels/heat/lesion.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

constexpr double kFarthest = 20e-3;  // [m]
constexpr double kFaint = 1e-9;      // Omega or dose that counts as none

double harm_at(const HeatBricks& bricks, const BrickIndex& voxel, LesionOf what) {
  const double coagulated = bricks.coagulation_at(voxel);
  return what == LesionOf::kCoagulated ? coagulated : std::max(coagulated, bricks.dose_at(voxel));
}

double log_harm(const Bioheat& heat, const Vec3& at, LesionOf what) {
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
      value += weight * std::log(std::max(kFaint, harm_at(heat.bricks(), base + step, what)));
  }
  return value;
}

// How far from `from` along `way` the logarithm stays above that of 1.
double extent(const Bioheat& heat, const Vec3& from, const Vec3& way, LesionOf what) {
  const double step = 0.05 * heat.options().voxel;
  double last = log_harm(heat, from, what);
  if (!(last >= 0.0)) return 0.0;
  for (double x = step; x < kFarthest; x += step) {
    const double now = log_harm(heat, from + x * way, what);
    if (now < 0.0) return x + step * now / std::max(1e-12, last - now);
    last = now;
  }
  return kFarthest;
}

}  // namespace

Lesion lesion_at(const Bioheat& heat, const Vec3& point, const Vec3& outward, LesionOf what) {
  // The outermost voxels' middles: nothing lies beyond to interpolate with.
  const double skin = 0.5 * heat.options().voxel;
  const Vec3 start = point - skin * outward;
  Lesion lesion;
  lesion.depth = extent(heat, start, -outward, what);
  if (lesion.depth > 0.0) lesion.depth += skin;
  const Vec3 side = outward.unitOrthogonal();
  lesion.width = extent(heat, start, side, what) + extent(heat, start, -side, what);
  return lesion;
}

}  // namespace viscera
