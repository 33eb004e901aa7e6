// What a hand feels, 1,000 times a second, of a touch that the frame alone can answer: its
// instrument's shaft, and its tip where no hive can stand.
//
// The frame finds the force; between two frames it goes on as the tissue's stiffness says. A touch
// never pulls: where the force would turn round, it has let go. What a new frame finds otherwise
// than the last one led to is eased in over a frame.
#pragma once

#include "haptics/tactile_model.h"
#include "haptics/triple_buffer.h"

namespace viscera {

/// As a frame found it; world.
struct AsFrameFound {
  Vec3 force = Vec3::Zero();      ///< on the tool, at its tip [N]
  Mat3 stiffness = Mat3::Zero();  ///< by how much it falls as the tip moves [N/m]
  Vec3 tip = Vec3::Zero();        ///< where that was [m]
  static constexpr auto fields() {
    using S = AsFrameFound;
    return std::tuple(field("force", &S::force), field("stiffness", &S::stiffness),
                      field("tip", &S::tip));
  }
};
static_assert(fields_cover<AsFrameFound>());

class FrameFeel {
 public:
  /// Frame's thread.
  TripleBuffer<AsFrameFound>& frames() { return frames_; }
  /// Servo thread: at this tip [m], `dt` [s] after it was asked last.
  TactileForce respond(const Vec3& tip, double dt) noexcept;

  struct State {
    TripleBuffer<AsFrameFound>::State frames;
    Vec3 uneased = Vec3::Zero();  ///< [N]
    static constexpr auto fields() {
      return std::tuple(field("frames", &State::frames), field("uneased", &State::uneased));
    }
  };
  State state() const { return {frames_.state(), uneased_}; }
  void restore(State state);
  static bool fits(const State& state) {
    return TripleBuffer<AsFrameFound>::fits(state.frames) && state.uneased.allFinite();
  }

 private:
  TripleBuffer<AsFrameFound> frames_;
  Vec3 uneased_ = Vec3::Zero();
};
static_assert(fields_cover<FrameFeel::State>());

}  // namespace viscera
