// What a hand feels of its instrument's shaft, 1,000 times a second.
//
// The frame finds the force; between two frames it goes on as the tissue's stiffness says. A shaft
// never pulls: where the force would turn round, it has let go. What a new frame finds otherwise
// than the last one led to is eased in over a frame.
#pragma once

#include "haptics/tactile_model.h"
#include "haptics/triple_buffer.h"

namespace viscera {

/// As a frame found it; world.
struct ShaftAsFelt {
  Vec3 force = Vec3::Zero();      ///< at the tip, by the lever [N]
  Mat3 stiffness = Mat3::Zero();  ///< by how much it falls as the tip moves [N/m]
  Vec3 tip = Vec3::Zero();        ///< where that was [m]
  static constexpr auto fields() {
    using S = ShaftAsFelt;
    return std::tuple(field("force", &S::force), field("stiffness", &S::stiffness),
                      field("tip", &S::tip));
  }
};
static_assert(fields_cover<ShaftAsFelt>());

class ShaftFeel {
 public:
  /// Frame's thread.
  TripleBuffer<ShaftAsFelt>& frames() { return frames_; }
  /// Servo thread: at this tip [m], `dt` [s] after it was asked last.
  TactileForce respond(const Vec3& tip, double dt) noexcept;

  struct State {
    TripleBuffer<ShaftAsFelt>::State frames;
    Vec3 uneased = Vec3::Zero();  ///< [N]
    static constexpr auto fields() {
      return std::tuple(field("frames", &State::frames), field("uneased", &State::uneased));
    }
  };
  State state() const { return {frames_.state(), uneased_}; }
  void restore(State state);
  static bool fits(const State& state) {
    return TripleBuffer<ShaftAsFelt>::fits(state.frames) && state.uneased.allFinite();
  }

 private:
  TripleBuffer<ShaftAsFelt> frames_;
  Vec3 uneased_ = Vec3::Zero();
};
static_assert(fields_cover<ShaftFeel::State>());

}  // namespace viscera
