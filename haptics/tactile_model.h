// What the servo tick asks of the tissue. The tick knows nothing else about what is touched.
#pragma once

#include <cstdint>

#include "kernels/base/types.h"

namespace viscera {

/// What a frame of the scene changes at a tool is shown over so long: a frame of 60 a second [s].
inline constexpr double kFrameEasing = 1.0 / 60.0;

/// Where the tool is, in the scene's frame.
struct ToolMotion {
  Pose pose;
  Vec3 velocity = Vec3::Zero();  ///< [m/s] of the tip
  std::uint32_t buttons = 0;     ///< of the device
  std::uint64_t tick = 0;
  std::uint64_t ticks = 1;  ///< since it was asked last: above 1 where a late loop has missed some
};

/// What the tissue does to the tool there.
struct TactileForce {
  Vec3 force = Vec3::Zero();  ///< [N] on the tool
  /// [N/m] by how much the force falls as the tool moves: -dF/dx, symmetric and not negative; zero
  /// without contact. The coupling needs its size: too large makes it slow to follow, too small by
  /// more than half makes it ring.
  Mat3 stiffness = Mat3::Zero();
  /// [J] that the tissue would give back; negative where the model can't tell.
  double energy = -1.0;
  /// [J] that the scene put in during this tick by moving the tissue (a breath): it may reach the
  /// hand without anything being wrong.
  double supplied = 0.0;
  bool touching = false;
};

/// Something that can be felt. respond() is called once a tick on the servo thread: it doesn't
/// wait, lock, allocate or throw.
class TactileModel {
 public:
  virtual ~TactileModel() = default;
  /// `dt` [s] since it was asked last: motion.ticks of them.
  virtual TactileForce respond(const ToolMotion& motion, double dt) noexcept = 0;
};

}  // namespace viscera
