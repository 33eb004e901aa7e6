#include "engine/features/contact/frame_feel.h"

#include <algorithm>

namespace viscera {
namespace {

Vec3 force_at(const AsFrameFound& felt, const Vec3& tip) {
  if (felt.force.isZero(0.0)) return Vec3::Zero();
  const Vec3 force = felt.force - felt.stiffness * (tip - felt.tip);
  return force.dot(felt.force) > 0.0 ? force : Vec3(Vec3::Zero());
}

}  // namespace

TactileForce FrameFeel::respond(const Vec3& tip, double dt) noexcept {
  uneased_ *= std::max(0.0, 1.0 - dt / kFrameEasing);
  const Vec3 before = force_at(frames_.front(), tip);
  if (frames_.update()) uneased_ += before - force_at(frames_.front(), tip);
  const Vec3 now = force_at(frames_.front(), tip);
  TactileForce answer;
  answer.force = now + uneased_;
  answer.touching = !now.isZero(0.0);
  if (answer.touching) answer.stiffness = frames_.front().stiffness;
  // What the tissue along a shaft would give back isn't known here; nothing, where none is touched.
  answer.energy = answer.touching || uneased_.norm() > 1e-6 ? -1.0 : 0.0;
  return answer;
}

void FrameFeel::restore(State state) {
  frames_.restore(std::move(state.frames));
  uneased_ = state.uneased;
}

}  // namespace viscera
