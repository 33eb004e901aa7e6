#include "engine/simulation/sentinel.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "engine/simulation/feature.h"

namespace viscera {
namespace {

/// "liver", "scene", "entity 7".
std::string name_of(const World& world, Entity owner) {
  if (const OrganBody* organ = world.find<OrganBody>(owner)) return organ->name;
  if (const InstrumentBody* tool = world.find<InstrumentBody>(owner)) return tool->description.name;
  return owner == kWhole ? "scene" : fmt::format("entity {}", owner.index);
}

}  // namespace

void tell_stray(const World& world, FrameReport& report, const MetStray& met) {
  report.raise(kNotFinite);
  report.strays.push_back(fmt::format("{}: {} of {}: found {} = {}, expected finite numbers",
                                      met.stage, met.what, name_of(world, met.owner),
                                      met.number.field, met.number.value));
}

void Sentinel::keep(const World& world) {
  const std::vector<StateType>& types = world.state_types();
  kept_.resize(types.size());
  for (std::size_t t = 0; t < types.size(); ++t) {
    if (types[t].strays.become != Strays::Become::kAsBefore) continue;
    ByteWriter writer(std::move(kept_[t]));
    types[t].save(world.states_of(types[t]), writer);
    kept_[t] = writer.take();
  }
}

void Sentinel::look(World& world, const Stage& stage, FrameReport& report) {
  for (const StateType& type : world.state_types())
    if (type.strays.become != Strays::Become::kUnwatched &&
        std::ranges::find(stage.changes, type.name) != stage.changes.end())
      look(world, stage, type, report);
}

void Sentinel::look(World& world, const Stage& stage, const StateType& type, FrameReport& report) {
  if (type.strays.unchanged && type.strays.unchanged(world)) return;
  store_detail::AnyPool& pool = world.states_of(type);
  const auto strays = type.first_strays(pool);
  if (strays.empty()) return;
  for (const auto& [owner, stray] : strays) {
    tell_stray(world, report, {stage.name, type.name, owner, stray});
    if (type.strays.contain) type.strays.contain(world, owner);
    if (type.strays.become == Strays::Become::kZero) type.zero_strays(pool, owner);
  }
  if (type.strays.become != Strays::Become::kAsBefore || type.first_strays(pool).empty()) return;
  const auto at = static_cast<std::size_t>(&type - world.state_types().data());
  ByteReader reader(kept_[at]);
  type.load(pool, reader);
}

}  // namespace viscera
