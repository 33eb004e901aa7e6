#include "engine/features/beds/blades_on_beds.h"

#include <algorithm>

#include "engine/features/beds/beds.h"
#include "engine/features/beds/cut_beds.h"
#include "engine/features/beds/strands_on_metal.h"
#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

/// Scissors have closed on what lies between places of their edges that are nearer than this [m],
/// as strands are thick; but for the hinge of open ones, which is always near.
constexpr double kSheared = 1e-3;
constexpr double kOpenScissors = 0.5;
/// Of the radius of a bond's area, what an edge must come to: half.
constexpr double kOfStrand = 0.5;

/// Along all edges that cut now.
std::vector<MetalBall> cutting_edges(const World& world) {
  std::vector<MetalBall> edges;
  const Pool<InstrumentBody>& tools = world.all<InstrumentBody>();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const InstrumentDescription& tool = tools[i].description;
    const BladeDescription* blade = blade_of(tool);
    if (!blade) continue;
    const InstrumentState& state = *world.find<InstrumentState>(tools.owner(i));
    const auto lines = edges_of(tool, state, Pose{});
    const double radius = 0.5 * blade->thickness;
    if (lines.size() == 1)
      for (const Vec3& place : lines[0]) edges.push_back({place, radius});
    if (lines.size() < 2 || state.jaw > kOpenScissors) continue;
    for (std::size_t k = 0; k < std::min(lines[0].size(), lines[1].size()); ++k)
      if ((lines[0][k] - lines[1][k]).norm() < kSheared)
        edges.push_back({0.5 * (lines[0][k] + lines[1][k]), radius});
  }
  return edges;
}

}  // namespace

bool blades_may_cut_beds(const World& world) {
  return world.has<Bed>() && std::ranges::any_of(world.all<InstrumentBody>(), [](const auto& tool) {
           return blade_of(tool.description) != nullptr;
         });
}

void cut_beds(World& world, const FrameContext&) {
  const std::vector<MetalBall> edges = cutting_edges(world);
  if (edges.empty()) return;
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const BedPlaces& places = places_now(world, beds.owner(b));
    const StrandsOnMetal strands(world, beds[b], places, edges, kOfStrand);
    BondStates& bonds = world.find<BedState>(beds.owner(b))->bonds;
    for (std::size_t i = 0; i < bonds.parted_by.size(); ++i)
      if (holds(places.layer, bonds, i) && strands.touched(i)) bonds.parted_by[i] = kPartedByCut;
  }
}

}  // namespace viscera
