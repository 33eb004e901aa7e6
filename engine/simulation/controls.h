// What moves the tools of a scene in one step: a person's device, a program, a recording, or, where
// nobody asks for anything else, the scene's own paths.
#pragma once

#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"

namespace viscera {

class World;

/// One instrument's, at the end of the step.
struct ToolControl {
  Vec3 tip = Vec3::Zero();  ///< [m]; of a tool that a haptic device holds: where its hand waits
  double jaw = 1.0;         ///< 0 closed ... 1 open
  double power = 0.0;       ///< asked of the generator: the pedal [W]
  bool blade = false;       ///< the trigger of a knife between its jaws
  static constexpr auto fields() {
    return std::tuple(field("tip", &ToolControl::tip), field("jaw", &ToolControl::jaw),
                      field("power", &ToolControl::power), field("blade", &ToolControl::blade));
  }
};
static_assert(fields_cover<ToolControl>());

struct Controls {
  std::vector<ToolControl> tools;  ///< one an instrument, in the scene's order
};

/// Faster than any hand: a tip that goes farther within a step has jumped [m].
inline constexpr double kFarthestPerStep = 0.1;

/// Where the scene's paths have its tools at `time` [s].
Controls controls_of_paths(const World& world, double time);
/// The same without new memory where `controls` has been filled before.
void controls_of_paths(const World& world, double time, Controls& controls);

/// Refuses, naming the tool, numbers that aren't finite, a jaw outside [0, 1], power of a tool that
/// doesn't conduct or below zero, a knife's trigger of what can't have one, a tip in its trocar,
/// and one that jumps; and a wrong number of tools.
Result<void> check_controls(const World& world, const Controls& controls);

}  // namespace viscera
