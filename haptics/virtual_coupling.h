// The spring and damper between the device and the tool in the scene.
#pragma once

#include "haptics/tactile_model.h"
#include "kernels/base/fields.h"

namespace viscera {

/// Colgate's virtual coupling [Colgate1995], [Adams1999]: the hand holds the tool through a spring
/// and a damper, so that nothing stiffer than these is ever shown, whatever the tissue does. The
/// tool has no mass: in the air it is where the device is and no force is felt; in contact it is
/// where coupling and tissue balance.
///
///   f = K e + B (e - e') / dt,  e = device - tool,  e' the last tick's
///   F(tool) + f = 0,  F taken as linear about the place where the tissue was asked
///
/// Both in one implicit step, so that a linear tissue is met without the tick of delay that a force
/// from the last place would have. One question to the tissue and two 3x3 solves a tick.
struct CouplingSettings {
  double stiffness = 2000.0;  ///< [N/m]
  double damping = 2.0;       ///< [N s/m]
};

class VirtualCoupling {
 public:
  explicit VirtualCoupling(const CouplingSettings& settings);

  /// The tool goes to the device, without force.
  void reset(const Vec3& device);
  /// Where to ask the tissue: where the tool would be if it were as at the last tick, `dt` [s] ago.
  Vec3 predict(const Vec3& device, double dt) const;
  /// Takes the tissue's answer at the predicted place; returns the force on the hand [N].
  Vec3 settle(const Vec3& device, const Vec3& asked_at, const TactileForce& tissue, double dt);

  const Vec3& tool() const { return state_.tool; }  ///< [m]
  double energy() const;                            ///< [J] in the spring

  struct State {
    Vec3 tool = Vec3::Zero(), stretch = Vec3::Zero();
    // The tissue about the place where it was last asked.
    Vec3 asked_at = Vec3::Zero(), force = Vec3::Zero();
    Mat3 stiffness = Mat3::Zero();
    static constexpr auto fields() {
      return std::tuple(field("tool", &State::tool), field("stretch", &State::stretch),
                        field("asked_at", &State::asked_at), field("force", &State::force),
                        field("stiffness", &State::stiffness));
    }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }

 private:
  Vec3 stretch(const Vec3& device, double dt) const;

  CouplingSettings settings_;
  State state_;
};
static_assert(fields_cover<VirtualCoupling::State>() && StateOwner<VirtualCoupling>);

}  // namespace viscera
