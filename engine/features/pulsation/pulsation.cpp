#include "engine/features/pulsation/pulsation.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace viscera {
namespace {

/// Strains that the shapes of linear organs can show.
constexpr double kGreatestStrain = 0.2;
/// Near where the organ is held the beat fades over this share of its size.
constexpr double kFade = 0.2;
/// What a place does shows this far around it, in spacings of the nodes: so far from where the
/// organ is held no place moves yet.
constexpr double kShows = 2.0;

FeatureKeys keys() {
  ObjectSpec spec{
      "A beat: the organ swells and goes back. A linear one's surface does, from its "
      "middle; at finite strain the tissue does, from where it is held.",
      {number("strain", "At its greatest: length gained over length.")
           .needed()
           .between(0, kGreatestStrain),
       number("rate_per_min", "Beats a minute.").needed().between(1, 600)},
      {},
      {}};
  FeatureKeys keys;
  keys.organ.keys = {object("pulsation", "How its surface beats; without it, it doesn't.", spec)};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (!organ.contains("pulsation")) return;
    const Json& values = organ["pulsation"];
    extras.set(PulsationDescription{.strain = values["strain"].get<double>(),
                                    .rate = values["rate_per_min"].get<double>() / 60.0});
  };
  return keys;
}

/// Places that only the beat moves must be there: as gravity does, it takes the whole body.
void reach(const SceneDescription&, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  if (organ.extras.find<PulsationDescription>() && organ.deformable) reach.sags = true;
}

/// 0 within `still` [m] of where the organ is held, 1 farther than `fade` [m] from there.
double freedom(const OrganDescription& organ, const Vec3& at, double still, double fade) {
  constexpr int kSteps = 16;
  for (int step = 0; step < kSteps; ++step)
    for (const Region& region : organ.fixed)
      if (region.grown(still + fade * step / kSteps).contains(at))
        return static_cast<double>(step) / kSteps;
  return 1.0;
}

std::vector<float> swelling(const OrganModel& model, const OrganDescription& organ) {
  const double fade = kFade * model.rest_bounds.sizes().maxCoeff();
  const Vec3 middle = model.rest_bounds.center();
  std::vector<float> swell;
  for (std::size_t p = 0; p < model.places.size(); ++p) {
    const Vec3& place = model.places.positions[p];
    const double still = kShows * model.places.spacings[p];
    const Vec3 way = freedom(organ, place, still, fade) * (place - middle);
    for (int axis = 0; axis < 3; ++axis) swell.push_back(static_cast<float>(way[axis]));
  }
  return swell;
}

Result<void> prepare(SceneModel& model) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    const OrganDescription& organ = model.scene().organs[o];
    const auto* pulsation = organ.extras.find<PulsationDescription>();
    const OrganModel& body = *model.constants().all<OrganBody>().find(model.organs()[o])->model;
    if (!pulsation || body.displacement_rows() == 0) continue;
    // Of tissue at finite strain the energy knows (finite.cpp).
    model.constants().all<PulsatingOrgan>().add(
        model.organs()[o],
        {*pulsation, body.finite ? std::vector<float>() : swelling(body, organ)});
  }
  return {};
}

Result<void> start(World& world) {
  const Pool<PulsatingOrgan>& organs = world.all<PulsatingOrgan>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const Entity organ = organs.owner(o);
    world.all<Pulse>().add(organ, {});
    if (!organs[o].swell.empty() && !world.find<FreeShape>(organ))
      world.all<FreeShape>().add(organ, level_shape(*world.find<OrganBody>(organ)->model));
  }
  return {};
}

void beat(World& world, const FrameContext& context) {
  Pool<Pulse>& pulses = world.all<Pulse>();
  for (std::size_t p = 0; p < pulses.size(); ++p) {
    const Entity organ = pulses.owner(p);
    const double strain = world.find<PulsatingOrgan>(organ)->description.at(context.time);
    if (strain == pulses[p].strain) continue;
    pulses[p].strain = strain;
    if (FreeShape* shape = world.find<FreeShape>(organ)) shape->stale = true;
  }
}

bool shape(const World& world, Entity organ, std::vector<float>& places) {
  const Pulse* pulse = world.find<Pulse>(organ);
  if (!pulse || pulse->strain == 0.0) return false;
  const std::vector<float>& swell = world.find<PulsatingOrgan>(organ)->swell;
  if (swell.empty()) return false;
  const auto strain = static_cast<float>(pulse->strain);
  for (std::size_t i = 0; i < swell.size(); ++i) places[i] += strain * swell[i];
  return true;
}

std::vector<ReportSection> report(const World& world) {
  const Pool<PulsatingOrgan>& organs = world.all<PulsatingOrgan>();
  if (organs.size() == 0) return {};
  Json list = Json::array();
  for (std::size_t o = 0; o < organs.size(); ++o)
    list.push_back({{"organ", world.find<OrganBody>(organs.owner(o))->name},
                    {"strain", organs[o].description.strain},
                    {"beats", organs[o].description.rate * world.time()}});
  return {report_section("pulsation", list)};
}

}  // namespace

double PulsationDescription::at(double time) const {
  return 0.5 * strain * (1.0 - std::cos(2.0 * std::numbers::pi * rate * time));
}

Feature pulsation_feature() {
  return {.name = "pulsation",
          .keys = keys(),
          .reach = reach,
          .prepare = prepare,
          .start = start,
          .states = {state_type<Pulse>()},
          .stages = {{.name = "beat",
                      .writes = {"parts of free shapes"},
                      .changes = {"pulses", "free shapes"},
                      .needed = [](const World& world) { return world.has<PulsatingOrgan>(); },
                      .run = beat}},
          .shape = shape,
          .report = report};
}

}  // namespace viscera
