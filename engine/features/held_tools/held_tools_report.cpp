#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/held_tools/held_tools.h"

namespace viscera {
namespace {

HapticFigures figures_of(const HapticTool& tool) {
  return {.tool = tool.name,
          .device = tool.device->name(),
          .ticks = tool.lockstep ? tool.lockstep->next() : tool.loop->statistics().ticks.load(),
          .greatest_force = tool.servo->greatest_force(),
          .energy = tool.servo->energy_given(),
          .passivity_violations = tool.servo->passivity_violations(),
          .tissue = tool.tissue->figures(),
          .frame_difference = tool.agreement.ratio(),
          .frames_at_rest = tool.agreement.frames,
          .events = tool.events};
}

}  // namespace

std::vector<HapticFigures> haptic_figures(const World& world) {
  std::vector<HapticFigures> all;
  if (const HapticTools* servos = servos_of(world))
    for (const HapticTool& tool : servos->tools()) all.push_back(figures_of(tool));
  return all;
}

std::vector<ReportSection> held_tools_report(const World& world) {
  Json list = Json::array();
  for (const HapticFigures& tool : haptic_figures(world))
    list.push_back({{"tool", tool.tool},
                    {"device", tool.device},
                    {"ticks", tool.ticks},
                    {"greatest_force_N", tool.greatest_force},
                    {"energy_J", tool.energy},
                    {"passivity_violations", tool.passivity_violations},
                    {"frames_at_rest", tool.frames_at_rest},
                    {"frame_difference", tool.frame_difference},
                    {"hives",
                     {{"built", tool.tissue.hives},
                      {"refused", tool.tissue.refused},
                      {"ticks_without", tool.tissue.uncovered}}},
                    {"beyond_linear",
                     {{"newton_steps", tool.tissue.newton_steps},
                      {"tangent_answers", tool.tissue.tangent_answers},
                      {"deadline_misses", tool.tissue.deadline_misses},
                      {"linear_answers", tool.tissue.linear_answers}}},
                    {"events", tool.events}});
  return {report_section("haptics", list)};
}

std::vector<SkippedReport> held_tools_skipped(const SceneDescription& scene) {
  if (holds_tools(scene)) return {};
  return {{"haptics", "no instrument is a haptic tool"}};
}

}  // namespace viscera
