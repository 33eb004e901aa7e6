#include "engine/features/shafts/tubes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

/// Axes whose directions differ by less than this (sine) count as parallel.
constexpr double kParallel = 1e-3;
constexpr double kSteel = 193e9;  // [Pa]
constexpr double kHollow = 0.8;   // inner over outer radius

double between_ends(double share) {
  return std::clamp(share, 0.0, 1.0);
}

}  // namespace

TubesNearest nearest(const Tube& one, const Tube& other) {
  const Vec3 d = one.pivot - one.tip, e = other.pivot - other.tip, r = one.tip - other.tip;
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e), dr = d.dot(r),
               er = e.dot(r);
  TubesNearest near{one.tip, other.tip, {}};
  if (!(dd > 0.0) || !(ee > 0.0)) return near;
  const Vec3 cross = d.cross(e);
  const double square = cross.squaredNorm();
  const bool parallel = !(square > kParallel * kParallel * dd * ee);
  const double s = parallel ? 0.0 : (de * er - ee * dr) / square;
  const double t = (de * between_ends(s) + er) / ee;
  const double along_other = between_ends(t);
  const double along =
      along_other == t ? between_ends(s) : between_ends((de * along_other - dr) / dd);
  near.on_one = one.tip + along * d;
  near.on_other = other.tip + along_other * e;
  if (!parallel && s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) near.across = cross.normalized();
  return near;
}

double bending_stiffness(const Tube& tube, const Vec3& at) {
  const double length = (tube.pivot - at).norm(), radius = tube.radius;
  const double moment =
      0.25 * std::numbers::pi * std::pow(radius, 4) * (1.0 - std::pow(kHollow, 4));  // [m4]
  const double bends = 3.0 * kSteel * moment / std::max(length * length * length, 1e-12);
  return std::min(bends, kStiffestTube);
}

}  // namespace viscera
