// One frame of simulated time: what a step needs, and what it may report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/io/trace.h"
#include "engine/simulation/controls.h"
#include "engine/simulation/frame_flag.h"
#include "engine/simulation/world.h"
#include "kernels/base/aside.h"

namespace viscera {

struct FrameReport {
  FlagSet flags;  ///< in the order of the model's features
  /// Numbers that weren't finite: "heat tissue: burns of liver: found heat.bricks[3].water[7] =
  /// nan, expected finite numbers".
  std::vector<std::string> strays;
  void raise(const FrameFlag& flag) { flags.raise(flag); }
};

/// What one step needs, rebuilt each time.
struct FrameContext {
  std::uint64_t frame = 0;
  double time = 0.0;  ///< at the end of the frame [s]
  double dt = 0.0;    ///< [s]
  FrameReport* report = nullptr;
  const Controls* controls = nullptr;
  Aside* aside = nullptr;  ///< what a stage begins and a later one waits for; ends with the step
};

/// Advances the world by one frame, tools where their paths have them. Throws nothing but
/// std::bad_alloc.
FrameReport step_frame(World& world, Trace& trace);
/// The same under these controls, which fit the world (check_controls). `trace` may be null.
FrameReport step_frame(World& world, const Controls& controls, Trace* trace);
/// Time at which the next step will end [s].
inline double end_of_step(const World& world) {
  return static_cast<double>(world.model().steps().last_tick(world.frame() + 1)) * 1e-3;
}

}  // namespace viscera
