// What `viscera haptics` found: lateness, computing time, energy, events.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "engine/features/held_tools/held_tools.h"
#include "kernels/base/result.h"
#include "tools/common/percentiles.h"

namespace viscera {

struct HapticToolReport {
  std::string name, device, scheduler;
  std::uint64_t ticks = 0, missed = 0;
  Percentiles lateness, compute;
  std::array<Percentiles, kTickParts> parts;
  double energy = 0.0;  ///< given to the hand [J]
  std::uint64_t passivity_violations = 0;
  double greatest_force = 0.0;  ///< on the hand [N]
  HiveTissueFigures tissue;
  std::vector<std::string> events;
};

struct HapticsReport {
  std::string scene, machine;
  int cores = 0;
  double seconds = 0.0;
  std::uint64_t frames = 0, late_frames = 0, pictures = 0;
  double simulated = 0.0;  ///< of the scene's time [s]
  std::string renderer;    ///< empty: no pictures
  std::vector<HapticToolReport> tools;
};

HapticToolReport report_of(HapticTool& tool);
void print(const HapticsReport& report, std::ostream& out);
/// {ticks, missed, lateness_us, compute_us, energy_J, passivity_violations, scheduler, ...} of the
/// first tool, and `tools` with those of all.
std::string to_json_text(const HapticsReport& report);
/// Histograms of lateness and computing time, one picture a tool.
Result<void> draw_latency_plots(const std::vector<HapticTool>& tools,
                                const std::filesystem::path& folder);

}  // namespace viscera
