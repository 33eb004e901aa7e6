// One frame of simulated time: what a step needs, and what it may report.
#pragma once

#include <cstdint>

#include "engine/io/trace.h"
#include "engine/simulation/controls.h"
#include "engine/simulation/world.h"

namespace viscera {

/// Frames end at tick floor(1000 k / 60): 60 Hz in whole milliseconds.
inline constexpr std::uint64_t kFramesPerSecond = 60;
constexpr std::uint64_t last_tick_of_frame(std::uint64_t frame) {
  return 1000 * frame / kFramesPerSecond;
}

/// Things that a frame may report; each says what to do about it.
enum class FrameFlag : std::uint32_t {
  /// A displacement came out non-finite: the organ is frozen at its last good state and answers no
  /// more force. Remedy: prepare it afresh (--no-cache); check its material and resolution.
  kOrganFrozen = 1u << 0,
  /// The contact problem had no solution: the organ kept its last shape and gave no force in that
  /// frame. Remedy: smaller steps of the tool, or fewer instruments on one spot.
  kContactNotConverged = 1u << 1,
  /// A tip touched tissue where no place of the surface is near enough to take its force: no
  /// response there. Remedy: a smaller spacing_mm.
  kOutOfReach = 1u << 2,
  /// A closed jaw slid over the tissue because the pull passed its grip limit. Remedy: none needed,
  /// or raise grip_limit_N.
  kGripSlipped = 1u << 3,
  /// More smoke particles were emitted than the volume holds; the oldest ended. Remedy: raise
  /// max_particles.
  kSmokeFull = 1u << 4,
  /// Tissue burnt outside every smoke volume: its smoke was not followed. Remedy: enlarge a smoke
  /// domain.
  kSmokeOutside = 1u << 5,
  /// A jaw closed on nothing: no tissue within its grip radius. Remedy: move the closing key
  /// nearer.
  kGripMissed = 1u << 6,
  /// Heat found no room for more bricks: tissue beyond them counts as cold. Remedy: a greater
  /// voxel.
  kHeatFull = 1u << 7,
  /// Current met an organ that heat isn't computed in. Remedy: the thermal values that its tissue
  /// lacks.
  kNotHeated = 1u << 8,
};

struct FrameReport {
  std::uint32_t flags = 0;
  void raise(FrameFlag flag) { flags |= static_cast<std::uint32_t>(flag); }
  bool has(FrameFlag flag) const { return (flags & static_cast<std::uint32_t>(flag)) != 0; }
};

/// What one step needs, rebuilt each time.
struct FrameContext {
  std::uint64_t frame = 0;
  double time = 0.0;  ///< at the end of the frame [s]
  double dt = 0.0;    ///< [s]
  FrameReport* report = nullptr;
  const Controls* controls = nullptr;
};

/// Advances the world by one frame, tools where their paths have them. Throws nothing but
/// std::bad_alloc.
FrameReport step_frame(World& world, Trace& trace);
/// The same under these controls, which fit the world (check_controls). `trace` may be null.
FrameReport step_frame(World& world, const Controls& controls, Trace* trace);
/// Time at which the next step will end [s].
inline double end_of_step(const World& world) {
  return static_cast<double>(last_tick_of_frame(world.frame() + 1)) * 1e-3;
}

}  // namespace viscera
