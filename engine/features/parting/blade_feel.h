// What a hand feels of its scalpel in tissue, 1,000 times a second.
//
// A blade gives way to nothing but along its way: tissue ahead of its edge holds it until it parts,
// by the fracture energy times the length of edge in it; what is cut already doesn't. Between two
// frames that is an anchor that the tip is tied to by a spring. The spring draws no harder than
// tissue on that side of the edge withstands: the anchor comes along then, and what the spring
// would store more has parted tissue. Nothing is ever given back but what the spring stores, so the
// loop stays passive whatever frames say.
#pragma once

#include <array>

#include "haptics/tactile_model.h"
#include "haptics/triple_buffer.h"

namespace viscera {

/// As a frame found it; world.
struct BladeAsFelt {
  static constexpr std::size_t kWays = 12;
  Vec3 along = Vec3::UnitZ();         ///< the edge, unit
  Vec3 side = Vec3::UnitX();          ///< across it; ways are counted from there
  Vec3 velocity = Vec3::Zero();       ///< of the tissue, by breathing [m/s]
  std::array<double, kWays> holds{};  ///< that way across it, as way() has them, at the most [N]

  /// The unit vectors across the edge that ways are counted from.
  std::array<Vec3, 2> across() const;
  Vec3 way(std::size_t k) const;
  static constexpr auto fields() {
    return std::tuple(field("along", &BladeAsFelt::along), field("side", &BladeAsFelt::side),
                      field("velocity", &BladeAsFelt::velocity),
                      field("holds", &BladeAsFelt::holds));
  }
};
static_assert(fields_cover<BladeAsFelt>());

class BladeFeel {
 public:
  /// Frame's thread.
  TripleBuffer<BladeAsFelt>& frames() { return frames_; }
  /// Servo thread: at this tip [m], `dt` [s] after it was asked last.
  TactileForce respond(const Vec3& tip, double dt) noexcept;

  struct State {
    TripleBuffer<BladeAsFelt>::State frames;
    Vec3 anchor = Vec3::Zero();  ///< where `held` [m]
    bool held = false;
    std::array<double, BladeAsFelt::kWays> holds{};  ///< eased [N]
    static constexpr auto fields() {
      return std::tuple(field("frames", &State::frames), field("anchor", &State::anchor),
                        field("held", &State::held), field("holds", &State::holds));
    }
  };
  State state() const { return {frames_.state(), anchor_, held_, holds_}; }
  void restore(State state);
  static bool fits(const State& state);

 private:
  TripleBuffer<BladeAsFelt> frames_;
  Vec3 anchor_ = Vec3::Zero();
  bool held_ = false;
  std::array<double, BladeAsFelt::kWays> holds_{};
};
static_assert(fields_cover<BladeFeel::State>() && StateOwner<BladeFeel>);

}  // namespace viscera
