// Bounds that keep a step of a body at finite strain sound.
#pragma once

#include <cmath>

#include "kernels/base/types.h"
#include "kernels/finite/finite_state.h"

namespace viscera {

/// Rotations are taken anew every so many steps.
inline constexpr int kStepsAWarp = 3;
/// More iterations for so many steps after tissue was let go.
inline constexpr int kStepsReleased = 5;
/// Further than this no target moves at once: the way is made in parts [m].
inline constexpr double kLongestWay = 6e-3;
/// Further than this no node moves in an iteration: turned inside out, tissue is so stiff that the
/// factor of the body at rest throws it metres away [m].
inline constexpr double kLongestMove = 50e-3;
/// Of the first search, over the slope [Armijo1966]; the slack is what the sums of an energy err
/// by.
inline constexpr double kArmijo = 1e-4, kSlack = 2e-6;
inline constexpr int kMostTrials = 6;
/// Where a further iteration would gain no more than this share of the energy, the step's other
/// start isn't asked for: it could save no more.
inline constexpr double kSureStart = 1e-2;
/// A way of which no more than this may be gone isn't gone so far: what answers is made stiffer, by
/// what may be gone but at most by the least share, so many times an iteration. Chosen.
inline constexpr double kFarEnough = 0.9, kLeastShare = 0.1;
inline constexpr int kMostStiffenings = 3;
/// A step of tissue that anything touches goes on while it would still gain more than this of its
/// energy, to so many iterations. Untouched, what was turned inside out finds back by its motion.
inline constexpr double kUnsettled = 1e-3;
inline constexpr int kMostOfAll = 20;
/// The model has foreseen what a way gains where it errs by no more than this share of it. A way
/// whose slope is at most so many times that of such a one needs no evaluation. Chosen.
inline constexpr double kForeseen = 0.25, kMuchLess = 0.25;
/// A step shorter than this says that the pairs of before don't fit.
inline constexpr double kShortest = 0.1;
/// A step that could move all of a body by no more than this has ended [m]. Chosen: what single
/// precision makes of displacements of a tenth of a metre.
inline constexpr double kNoWay = 10e-9;
/// A step that changes what the factor makes of the gradient by a smaller share is the last: some
/// hundred times the rounding of single precision.
inline constexpr double kLeastChange = 1e-4;
/// Beyond these a state isn't tissue's any more: the last good one is taken back.
inline constexpr double kFarthest = 0.2;      // [m]
inline constexpr double kFarthestFree = 1.0;  // ... of what nothing holds [m]
/// What nothing holds and has gone farther than this is out of view, and stays there [m].
inline constexpr double kInView = 0.5;
inline constexpr double kFastest = 2.0;  // [m/s]
/// Of what nothing holds no node's surroundings have more, or less by its inverse, of their volume
/// at rest: what presses one is a few times its weight.
inline constexpr double kMostSwelled = 2.0;
/// ... nor does a step of one count whose end could still gain so much of its energy.
inline constexpr double kMostResidual = 0.5;

/// What a further iteration would gain, over the energy that there would be: 1 where a body at rest
/// without energy is about to move.
inline double residual_of(double gain, double energy) {
  return gain > 0.0 ? gain / (gain + std::abs(energy)) : 0.0;
}

/// The last good state stays, at rest.
inline void give_up(FiniteState& state) {
  state.velocities.assign(state.velocities.size(), 0.0);
  state.loads.assign(state.loads.size(), 0.0);
  state.steps_since_warp = kStepsAWarp;
  ++state.lost;
}

}  // namespace viscera
