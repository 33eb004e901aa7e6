#include "engine/features/shafts/press_tools.h"

#include <algorithm>

#include "engine/features/shafts/shafts.h"
#include "engine/features/shafts/tubes.h"
#include "engine/simulation/instruments.h"

namespace viscera {
namespace {

/// Two that lie deeper in each other than this are told [m]: chosen, a third of a tool's width.
constexpr double kMostCrossed = 2e-3;

/// `state`: of an instrument; null: it is the endoscope's barrel, at that time [s].
Tube tube_of(const World& world, Entity shaft, double time, const InstrumentState* state) {
  const double radius = world.find<Shaft>(shaft)->radius;
  if (state) return {state->tip, world.find<InstrumentBody>(shaft)->description.trocar, radius};
  const ShaftAxis axis = axis_of_shaft(world, shaft, time);
  return {axis.at(0.0), axis.at(axis.length), radius};
}

std::vector<Tube> tubes_now(const World& world, double time) {
  std::vector<Tube> tubes;
  for (const Entity shaft : world.all<ShaftState>().owners())
    tubes.push_back(tube_of(world, shaft, time, world.find<InstrumentState>(shaft)));
  return tubes;
}

/// Where their paths begin: tools aren't placed yet.
std::vector<Tube> tubes_at_start(const World& world) {
  std::vector<Tube> tubes;
  for (const Entity shaft : world.all<ShaftState>().owners()) {
    InstrumentState state;
    const InstrumentBody* body = world.find<InstrumentBody>(shaft);
    if (body) place_tool(*body, 0.0, state);
    tubes.push_back(tube_of(world, shaft, 0.0, body ? &state : nullptr));
  }
  return tubes;
}

/// The way that the first is pushed, and how far apart both are along it, below 0 inside.
struct Apart {
  Vec3 direction = Vec3::UnitZ();
  double gap = 0.0;  // [m]
};

/// `sides`: of the first tool, by the others.
Apart apart_on_their_side(const Tube& one, const Tube& two, const TubesNearest& near, Entity other,
                          std::vector<ShaftState::Side>& sides) {
  const Vec3 between = near.on_one - near.on_other;
  const double both = one.radius + two.radius;
  const auto known = std::ranges::find(sides, other, &ShaftState::Side::other);
  if (!near.across) {
    if (known != sides.end()) sides.erase(known);
    const double distance = between.norm();
    const Vec3 away = distance > 0.0 ? Vec3(between / distance) : Vec3(Vec3::UnitZ());
    return {away, distance - both};
  }
  const double height = between.dot(*near.across);
  double side = height < 0.0 ? -1.0 : 1.0;
  if (known == sides.end())
    sides.push_back({other, side});
  else
    side = known->side;
  return {side * *near.across, side * height - both};
}

/// Calls visit(one, other, their tubes, where these are nearest, how far apart on their side).
template <class Visit>
void each_pair(World& world, const std::vector<Tube>& tubes, const Visit& visit) {
  Pool<ShaftState>& states = world.all<ShaftState>();
  for (std::size_t i = 0; i < states.size(); ++i)
    for (std::size_t j = i + 1; j < states.size(); ++j) {
      const Entity one = states.owner(i), other = states.owner(j);
      const TubesNearest near = nearest(tubes[i], tubes[j]);
      visit(one, other, tubes[i], tubes[j], near,
            apart_on_their_side(tubes[i], tubes[j], near, other, states[i].sides));
    }
}

}  // namespace

void note_sides(World& world) {
  each_pair(world, tubes_at_start(world),
            [](Entity, Entity, const Tube&, const Tube&, const TubesNearest&, const Apart&) {});
}

std::vector<ToolPress> press_tools(World& world, const FrameContext& context) {
  std::vector<ToolPress> presses;
  each_pair(
      world, tubes_now(world, context.time),
      [&](Entity one, Entity other, const Tube& first, const Tube& second, const TubesNearest& near,
          const Apart& apart) {
        if (!(apart.gap < 0.0)) return;
        const double a = bending_stiffness(first, near.on_one),
                     b = bending_stiffness(second, near.on_other);
        const double stiffness = a * b / (a + b), overlap = -apart.gap;
        const Vec3 force = stiffness * overlap * apart.direction;
        presses.push_back({one, other, force, near.on_one, apart.direction, stiffness, overlap});
        presses.push_back(
            {other, one, -force, near.on_other, -apart.direction, stiffness, overlap});
        if (overlap > kMostCrossed) context.report->raise(kToolsCross);
      });
  return presses;
}

}  // namespace viscera
