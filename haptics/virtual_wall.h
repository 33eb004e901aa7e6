// The two bodies that haptic devices are tried with: a wall and a ball of given stiffness.
#pragma once

#include <algorithm>

#include "haptics/tactile_model.h"

namespace viscera {

/// A flat wall: pushes along its normal with stiffness times depth, and damps what moves into it.
class VirtualWall : public TactileModel {
 public:
  Vec3 place = Vec3::Zero();    ///< [m] a point of the surface
  Vec3 normal = Vec3::UnitZ();  ///< outward, of length 1
  double stiffness = 0.0;       ///< [N/m]
  double damping = 0.0;         ///< [N s/m] while the tip goes in

  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    TactileForce out;
    out.energy = 0.0;
    const double depth = normal.dot(place - motion.pose.position);
    if (depth <= 0.0) return out;
    const double inward = std::max(0.0, -normal.dot(motion.velocity));
    out.touching = true;
    out.force = (stiffness * depth + damping * inward) * normal;
    out.stiffness = (stiffness + (inward > 0.0 ? damping / dt : 0.0)) * normal * normal.transpose();
    out.energy = 0.5 * stiffness * depth * depth;
    return out;
  }
};

/// A ball: pushes away from its centre with stiffness times depth.
class VirtualBall : public TactileModel {
 public:
  Vec3 centre = Vec3::Zero();  ///< [m]
  double radius = 0.0;         ///< [m]
  double stiffness = 0.0;      ///< [N/m]

  TactileForce respond(const ToolMotion& motion, double) noexcept override {
    TactileForce out;
    out.energy = 0.0;
    const Vec3 arm = motion.pose.position - centre;
    const double distance = arm.norm(), depth = radius - distance;
    if (depth <= 0.0 || distance == 0.0) return out;
    const Vec3 normal = arm / distance;
    out.touching = true;
    out.force = stiffness * depth * normal;
    // Sideways the normal turns and the force with it: that part would be negative, and is left
    // out.
    out.stiffness = stiffness * normal * normal.transpose();
    out.energy = 0.5 * stiffness * depth * depth;
    return out;
  }
};

}  // namespace viscera
