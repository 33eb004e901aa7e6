#include "engine/features/shafts/lever.h"

#include <cmath>

namespace viscera {
namespace {

/// Nearer to its trocar the tip is no lever [m].
constexpr double kShortestLever = 1e-3;

}  // namespace

double lever_share(const Vec3& at, const Vec3& tip, const Vec3& trocar) {
  const Vec3 arm = tip - trocar;
  const double length2 = arm.squaredNorm();
  return length2 > kShortestLever * kShortestLever ? (at - trocar).dot(arm) / length2 : 0.0;
}

LeverForces about_trocar(const ShaftLoad& load, const Vec3& tip, const Vec3& trocar) {
  LeverForces forces;
  const Vec3 arm = tip - trocar;
  const double length2 = arm.squaredNorm();
  if (length2 > kShortestLever * kShortestLever) {
    // arm x (torque x arm) / |arm|^2 is what of the torque lies across the arm.
    forces.at_tip = load.torque.cross(arm) / length2 + load.force.dot(arm) / length2 * arm;
    forces.twist = load.torque.dot(arm) / std::sqrt(length2);
  }
  forces.reaction = forces.at_tip - load.force;
  return forces;
}

}  // namespace viscera
