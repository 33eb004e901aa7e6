#include "engine/features/parting/jaw_knife.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "engine/features/cautery/cautery_keys.h"
#include "engine/features/jaws/hold.h"

namespace viscera {
namespace {

/// Of the knife. Chosen.
constexpr double kKnifeThickness = 0.4e-3;  // [m]
/// It takes so long to run forward, or back [s]. Chosen.
constexpr double kKnifeRuns = 0.3;
/// Its edge reaches so far beyond the grip surfaces, that no thread stays at the tissue's [m].
constexpr double kBeyondGrip = 0.5e-3;
/// Places along its edge, and along its way, are so far from each other at most [m].
constexpr double kAlongKnife = 1e-3;

/// Across the plane between the jaws, from their tip [m].
struct GripHeights {
  double low = 0.0, high = 0.0;
  void extend(double height) {
    low = std::min(low, height);
    high = std::max(high, height);
  }
};

/// Of the grip surfaces, as far as they hold tissue from two sides.
GripHeights grip_heights(const World& world, Entity instrument, const Jaws& jaws) {
  GripHeights heights;
  const std::optional<Grasp>& grasp = world.find<InstrumentContact>(instrument)->grasp;
  if (!grasp || jaws.upper == 0) return heights;
  const Pose& pose = pose_of(world, grasp->organ);
  for (std::size_t k = 0; k < grasp->cells.size(); ++k) {
    const Vec3 place = grasp->cells[k].position + carried(jaws, *grasp, k, pose);
    heights.extend((pose.to_world(place) - jaws.tip).dot(jaws.normal));
  }
  return heights;
}

}  // namespace

double knife_way_of(const InstrumentDescription& instrument) {
  const BipolarDescription* bipolar = bipolar_of(instrument);
  return bipolar && jaws_of(instrument) ? bipolar->blade : 0.0;
}

bool path_runs_knife(const InstrumentDescription& instrument) {
  return knife_way_of(instrument) > 0.0 &&
         std::ranges::any_of(instrument.path, [](const InstrumentKey& key) { return key.blade; });
}

BladeDescription knife_of(const InstrumentDescription& instrument) {
  return {2.0 * (instrument.grip_radius + kBeyondGrip), kKnifeThickness};
}

void run_knives(World& world, double dt) {
  Pool<JawKnife>& knives = world.all<JawKnife>();
  for (std::size_t k = 0; k < knives.size(); ++k) {
    const Entity instrument = knives.owner(k);
    const bool forward = world.find<InstrumentState>(instrument)->blade &&
                         world.find<InstrumentContact>(instrument)->jaw_closed;
    knives[k].before = knives[k].travel;
    knives[k].travel = std::clamp(knives[k].travel + (forward ? dt : -dt) / kKnifeRuns, 0.0, 1.0);
  }
}

std::vector<Vec3> knife_way(const InstrumentDescription& tool, const InstrumentState& state,
                            const Pose& organ) {
  const double way = knife_way_of(tool);
  const int pieces = std::max(1, static_cast<int>(std::ceil(way / kAlongKnife)));
  std::vector<Vec3> places;
  for (int i = 0; i <= pieces; ++i)
    places.push_back(organ.to_local(state.tip + way * i / pieces * state.shaft_direction));
  return places;
}

std::vector<Vec3> knife_edge(const World& world, Entity instrument, Entity organ, double travel) {
  const InstrumentDescription& tool = world.find<InstrumentBody>(instrument)->description;
  const Jaws& jaws = *world.find<Jaws>(instrument);
  const Pose& pose = pose_of(world, organ);
  const Vec3 middle = jaws.tip + (1.0 - travel) * knife_way_of(tool) * jaws.shaft;
  GripHeights heights = grip_heights(world, instrument, jaws);
  // What lies between the jaws behind the patch that they hold isn't squeezed here, where the bars
  // of real ones would: the edge reaches through it.
  if (may_lie_within(world, organ, middle, tool.grip_radius)) {
    const std::array<Vec3, 1> place = {pose.to_local(middle)};
    const std::array<double, 1> area = {1.0};
    const Pinch between = pinched(world, organ, place, area, jaws.normal, 2.0 * tool.grip_radius);
    for (const ContactCell& cell : between.cells)
      heights.extend(
          (pose.to_world(cell.position + cell.displacement) - jaws.tip).dot(jaws.normal));
  }
  const int pieces = static_cast<int>(std::ceil(knife_of(tool).length / kAlongKnife));
  const double low = heights.low - kBeyondGrip, high = heights.high + kBeyondGrip;
  std::vector<Vec3> edge;
  for (int i = 0; i <= pieces; ++i)
    edge.push_back(pose.to_local(middle + (low + (high - low) * i / pieces) * jaws.normal));
  return edge;
}

}  // namespace viscera
