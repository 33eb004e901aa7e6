// Viscosity of the gas on the faces of its grid.
#pragma once

#include <cstdint>

#include "kernels/smoke/gas_layout.h"

namespace viscera {

/// du/dt = nu lap u by a super-time-stepping Runge-Kutta-Legendre scheme of first order
/// [Meyer2012]: s explicit stages are stable, without overshoot, over (s^2 + s)/2 explicit steps.
class GasViscosity {
 public:
  /// At most so many stages; a longer step (nu dt above some 300 cells squared) diffuses by less
  /// than asked, as far as they reach.
  static constexpr int kMostStages = 64;

  /// What walls do to the gas beside them.
  struct Walls {
    bool no_slip = true;
    std::array<bool, 6> open{};  ///< sides (-x, +x, ...) without a wall
  };

  /// `free` faces change (not 0); others are walls with their own velocity.
  void set_walls(const GasLayout& layout, const std::array<std::vector<std::uint8_t>, 3>& free,
                 const Walls& walls);
  void step(const Vec3& spacing, double viscosity, double dt, GasFaces& velocity);

 private:
  // next = now_part now + before_part before + weights . (second differences of now), along each
  // axis.
  void stage(int axis, float now_part, float before_part, const Vec3f& weights,
             const std::vector<float>& now, const std::vector<float>& before,
             std::vector<float>& next) const;

  GasLayout layout_;
  // How much a face pulls at the next one, across its axis: 1 where gas flows, 2 at a wall half a
  // cell away, 0 where gas slides. Along its axis: 1 for every face that there is.
  GasFaces aside_, along_;
  GasFaces free_;  // 1 or 0
  // Stages; an axis has its own, since arrays are swapped and ghosts differ from axis to axis.
  GasFaces before_, now_, next_;
};

}  // namespace viscera
