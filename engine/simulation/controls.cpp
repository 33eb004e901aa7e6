#include "engine/simulation/controls.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/simulation/world.h"

namespace viscera {
namespace {

/// A shaft needs a direction [m].
constexpr double kShortestShaft = 1e-3;
/// As scene files have it [W].
constexpr double kGreatestPower = 400.0;

/// Jaws conduct where their path says so: scene files refuse it of others.
bool can_conduct(const InstrumentDescription& tool) {
  return conducts(tool.kind) ||
         std::ranges::any_of(tool.path, [](const InstrumentKey& key) { return key.power > 0.0; });
}

}  // namespace

void controls_of_paths(const World& world, double time, Controls& controls) {
  controls.tools.clear();
  for (const InstrumentBody& body : world.all<InstrumentBody>()) {
    const InstrumentKey& key = body.description.path[body.tip.key_at(time)];
    controls.tools.push_back({body.tip.at(time), body.jaw.at(time).x(), key.power, key.blade});
  }
}

Controls controls_of_paths(const World& world, double time) {
  Controls controls;
  controls_of_paths(world, time, controls);
  return controls;
}

Result<void> check_controls(const World& world, const Controls& controls) {
  const Pool<InstrumentBody>& bodies = world.all<InstrumentBody>();
  if (controls.tools.size() != bodies.size())
    return failure(fmt::format("controls: found {} tools, expected the scene's {}",
                               controls.tools.size(), bodies.size()));
  Error error;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const InstrumentDescription& tool = bodies[i].description;
    const ToolControl& asked = controls.tools[i];
    const auto wrong = [&](const std::string& found) {
      error.messages.push_back(fmt::format("controls of \"{}\": found {}", tool.name, found));
    };
    if (!asked.tip.allFinite()) {
      wrong("a tip that isn't finite, expected metres");
      continue;
    }
    if (!(asked.jaw >= 0.0 && asked.jaw <= 1.0))
      wrong(fmt::format("the jaw {:g}, expected 0 (closed) to 1 (open)", asked.jaw));
    if (!(asked.power >= 0.0 && asked.power <= kGreatestPower))
      wrong(fmt::format("{:g} W, expected 0 to {:g}", asked.power, kGreatestPower));
    else if (asked.power > 0.0 && !can_conduct(tool))
      wrong(
          fmt::format("{:g} W, expected 0: only a hook, a spatula, scissors or jaws whose path "
                      "has current conducts",
                      asked.power));
    if (asked.blade && tool.kind != InstrumentKind::kGrasper)
      wrong("a knife's trigger, expected none: only a grasper has a knife between its jaws");
    if ((asked.tip - tool.trocar).norm() < kShortestShaft)
      wrong("the tip in its trocar, expected it at least 1 mm away");
    // Before the first step nothing is anywhere yet.
    if (world.frame() == 0) continue;
    const double way = (asked.tip - world.find<InstrumentState>(bodies.owner(i))->tip).norm();
    if (way > kFarthestPerStep && !world.find<HeldTip>(bodies.owner(i)))
      wrong(fmt::format("a tip that jumps by {:.0f} mm in one step, expected at most {:.0f}",
                        1e3 * way, 1e3 * kFarthestPerStep));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

}  // namespace viscera
