// Smoke: what comes from burns and from steady sources, and the gas that carries it.
#include "engine/features/smoke/smoke.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/features/cautery/cautery.h"
#include "engine/features/gas/gas.h"
#include "engine/features/smoke/puffs.h"
#include "engine/features/smoke/smoke_setup.h"
#include "kernels/smoke/gas_around.h"

namespace viscera {
namespace {

/// How far over the tissue vapour is seen first [m].
constexpr double kOverTissue = 0.5e-3;
/// Organs within this distance of a volume are looked at for its particles: more than tissue moves
/// in a run [m].
constexpr double kObstacleMargin = 30e-3;
/// A jet gets no farther: a cavity's width [m]; and has by then become one with the gas [s].
constexpr double kJetRoom = 0.3, kJetTime = 1.0;

/// What leaves tissue and steady sources in a frame, evenly.
struct FrameEmissions {
  struct Jet {
    Entity volume;
    std::size_t emitter;
    SmokeEmission emission;  ///< but for its mass, number and duration
    double particles, mass;  ///< in the frame; [kg]
  };
  std::vector<GasSource> gas;
  std::vector<Jet> jets;

  /// What leaves after it has room by shapes as they are now.
  void add(World& world, const GasSource& source) {
    follow_organs(world);
    gas.push_back(source);
  }
};

/// Whole particles go out with all the mass that is owed; a turn that owes none carries its mass to
/// the next with it. `share`: of what leaves in a frame.
void emit_owed(SmokeBody& smoke, const FrameEmissions::Jet& jet, double share, double duration,
               FrameReport& report) {
  SmokeDebt& emitter = smoke.debts[jet.emitter];
  emitter.particles_owed += share * jet.particles;
  emitter.mass_owed += share * jet.mass;
  SmokeEmission emission = jet.emission;
  emission.particles = static_cast<int>(emitter.particles_owed);
  if (emission.particles == 0) return;
  emitter.particles_owed -= emission.particles;
  emission.mass = std::exchange(emitter.mass_owed, 0.0);
  emission.duration = duration;
  const std::uint64_t crowded_out = smoke.volume.counters().crowded_out;
  smoke.volume.emit(emission);
  if (smoke.volume.counters().crowded_out > crowded_out) report.raise(kSmokeFull);
}

struct Fed {
  const SmokeSource* source;
  Entity volume;
  std::size_t emitter;
};

/// The volumes into which a hook's burn at this place smokes: those that name it, or the first that
/// takes any.
std::vector<Fed> fed_by(const World& world, Entity hook, const Vec3& place) {
  std::vector<Fed> named, any;
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < sources.size(); ++s) {
    const SmokeSource& source = sources[s];
    if (!source.description.domain.contains(place)) continue;
    for (std::size_t e = 0; e < source.emitters.size(); ++e)
      if (source.emitters[e].instrument == hook)
        (source.takes_any_hook ? any : named).push_back({&source, sources.owner(s), e});
  }
  if (named.empty() && !any.empty()) named.push_back(any.front());
  return named;
}

/// Where vapour comes out of an organ's surface.
struct Vent {
  Vec3 position = Vec3::Zero();   ///< a little over it, as it is now, world [m]
  Vec3 direction = Vec3::Zero();  ///< out of it
  Vec3 outward = Vec3::Zero();    ///< out of it at rest, rest frame
};

Vent vent_of(const World& world, Entity organ, const Vec3& rest) {
  const OrganBody& body = *world.find<OrganBody>(organ);
  const std::vector<Vec3f>& now = world.find<OrganState>(organ)->positions;
  const SurfacePoint at = surface_left(world, organ).closest(rest).point;
  const auto& corners = body.model->surface.triangles[static_cast<std::size_t>(at.triangle)];
  std::array<Vec3, 3> corner;
  Vec3 place = Vec3::Zero();
  Vent vent;
  for (std::size_t c = 0; c < 3; ++c) {
    vent.outward += at.weights[static_cast<int>(c)] *
                    body.model->rest_normals[static_cast<std::size_t>(corners[c])].cast<double>();
    corner[c] = now[static_cast<std::size_t>(corners[c])].cast<double>();
    place += at.weights[static_cast<int>(c)] * corner[c];
  }
  const Vec3 across = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  const Pose& pose = pose_of(world, organ);
  vent.outward.normalize();
  vent.direction = pose.direction_to_world(across.norm() > 0.0 ? Vec3(across.normalized())
                                                               : Vec3(Vec3::UnitZ()));
  vent.position = pose.to_world(place) + kOverTissue * vent.direction;
  return vent;
}

/// The gas and the smoke of a jet: the gas gets its momentum as far as smoke runs ahead of it.
GasSource source_of(const SmokeEmission& emission, const JetDrag& drag, const GasGift& gift,
                    double mass) {
  GasSource source;
  source.position = emission.position;
  source.direction = emission.direction.normalized();
  source.radius = emission.radius;
  source.reach = std::min(emission.reach, drag.way_after(emission.speed, kJetTime));
  source.impulse = mass * emission.speed;
  source.gift = gift;
  return source;
}

void emit_burns(World& world, Entity organ, const OrganBurn& burn, const FrameContext& context,
                FrameEmissions& out) {
  const GasMixture mixture = gas_of(world.model().scene()).mixture();
  for (const Puff& puff : puffs_of(burn.heat, mixture)) {
    const Vent vent = vent_of(world, organ, puff.place);
    const double area = area_over(puff.voxels, vent.outward, burn.heat.options().voxel);
    SmokeEmission emission;
    emission.position = vent.position;
    emission.direction = vent.direction;
    emission.radius = std::sqrt(area / std::numbers::pi);
    emission.speed = vent_speed(puff.gas.volume, area, context.dt);
    emission.reach = room_for_jet(world, emission.position, emission.direction, kJetRoom);
    emission.temperature = puff.temperature - mixture.temperature;
    const std::vector<Fed> volumes = fed_by(world, burn.hook, emission.position);
    if (volumes.empty()) {
      context.report->raise(kSmokeOutside);
      continue;
    }
    const JetDrag drag = jet_drag(volumes.front().source->parameters);
    out.add(world, source_of(emission, drag, puff.gas, puff.mass));
    for (const auto& [source, volume, emitter] : volumes) {
      const double mass = puff.smoke / static_cast<double>(volumes.size());
      out.jets.push_back(
          {volume, emitter, emission, mass / source->description.particle_mass, mass});
    }
  }
}

/// Sparks' columns, and what current finds no tissue for, warm the gas over where they burn.
void warm_gas(World& world, const BurnTrace& trace, const FrameContext& context,
              FrameEmissions& out) {
  const double heat = trace.current.gas_power * context.dt;
  if (!(heat > 0.0) || !world.find<BurnableOrgan>(trace.organ)) return;
  const Vent vent = vent_of(world, trace.organ, trace.contact.point);
  GasSource source;
  source.position = vent.position;
  source.direction = vent.direction;
  source.radius = trace.current.radius;
  source.gift = GasGift::warmth(gas_of(world.model().scene()).mixture(), heat);
  out.add(world, source);
}

/// Gas as heavy as the cavity's, through the circle of the ball.
void emit_steadily(World& world, Entity volume, std::size_t emitter,
                   const EmitterDescription& place, const FrameContext& context,
                   FrameEmissions& out) {
  if (!place.when.contains(context.time)) return;
  SmokeEmission emission;
  emission.position = place.position;
  emission.direction = place.direction;
  emission.speed = place.speed;
  emission.radius = place.radius;
  emission.temperature = place.excess;
  emission.reach =
      room_for_jet(world, emission.position, emission.direction.normalized(), kJetRoom);
  const GasMixture mixture = gas_of(world.model().scene()).mixture();
  const double area = std::numbers::pi * place.radius * place.radius;
  const double gas = place.speed * area * context.dt;  // [m3]
  const double mass =
      gas * mixture.density() * mixture.temperature / (mixture.temperature + place.excess);
  const SmokeParameters& parameters = world.find<SmokeBody>(volume)->volume.parameters();
  if (gas > 0.0)
    out.add(world, source_of(emission, jet_drag(parameters),
                             {gas, gas * mixture.heat_of(place.excess), 0.0}, mass));
  out.jets.push_back(
      {volume, emitter, emission, place.particles * context.dt, place.rate * context.dt});
}

bool smokes(const World& world) {
  return world.has<SmokeBody>();
}

// --- what smoke meets ---------------------------------------------------------------------------

const SurfaceTopology* topology_of(const World& world, Entity organ,
                                   const TriangleSurface& surface) {
  const CutTopology* cut = world.find<CutTopology>(organ);
  return cut ? cut->topology.get() : world.one<SmokeScenery>()->topologies.at(&surface).get();
}

/// Smoke meets what cuts have left of an organ.
void meet_what_is_left(World& world, Entity organ, const Continuation*) {
  if (!smokes(world)) return;
  CutTopology made{topology_of(world.find<OrganBody>(organ)->model->surface)};
  if (CutTopology* before = world.find<CutTopology>(organ))
    *before = std::move(made);
  else
    world.all<CutTopology>().add(organ, std::move(made));
}

std::vector<SmokeSurface> surfaces_near(const World& world, const Box& domain) {
  std::vector<SmokeSurface> surfaces;
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const Entity organ = world.all<OrganBody>().owner(o);
    const OrganBody& body = world.all<OrganBody>()[o];
    const Pose& pose = pose_of(world, organ);
    Box bounds;
    for (int corner = 0; corner < 8; ++corner)
      bounds.extend(
          pose.to_world(body.model->rest_bounds.corner(static_cast<Box::CornerType>(corner))));
    if (domain.exteriorDistance(bounds) > kObstacleMargin) continue;
    const OrganState& state = *world.find<OrganState>(organ);
    surfaces.push_back({organ.index, topology_of(world, organ, body.model->surface),
                        state.positions, pose, state.version + 1});
  }
  return surfaces;
}

/// The instruments' shafts, each where it is and where it was a frame ago.
std::vector<SmokeObstacle> tools_now(World& world) {
  std::vector<SmokeObstacle> tools;
  const std::vector<SmokeObstacle>& before = world.one<SmokeTools>()->tools;
  for (std::size_t i = 0; i < world.all<InstrumentBody>().size(); ++i) {
    const Entity instrument = world.all<InstrumentBody>().owner(i);
    const InstrumentDescription& body = world.all<InstrumentBody>()[i].description;
    const InstrumentState& state = *world.find<InstrumentState>(instrument);
    SmokeObstacle tool;
    tool.from = state.tip;
    tool.to = body.trocar;
    tool.from_before = i < before.size() ? before[i].from : tool.from;
    tool.to_before = i < before.size() ? before[i].to : tool.to;
    tool.radius = body.shaft_radius;
    tools.push_back(tool);
  }
  world.one<SmokeTools>()->tools = tools;
  return tools;
}

/// What left the tissue of OrganBurn, steady sources -> FrameEmissions, their heat and sparks' with
/// it.
void emit_smoke(World& world, const FrameContext& context) {
  Pool<FrameEmissions>& kept = world.all<FrameEmissions>();
  if (kept.size() == 0) kept.add(kWhole, {});
  FrameEmissions& out = kept[0];
  out.gas.clear();
  out.jets.clear();
  for (const BurnTrace& trace : world.all<BurnTrace>()) warm_gas(world, trace, context, out);
  for (std::size_t b = 0; b < world.all<OrganBurn>().size(); ++b)
    emit_burns(world, world.all<OrganBurn>().owner(b), world.all<OrganBurn>()[b], context, out);
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < sources.size(); ++s)
    for (std::size_t e = 0; e < sources[s].emitters.size(); ++e) {
      const EmitterDescription& place = sources[s].emitters[e].description;
      if (place.instrument.empty()) emit_steadily(world, sources.owner(s), e, place, context, out);
    }
}

/// Gas and smoke take turns, and smoke flows out once a turn: in a turn of 1/30 s a third less of
/// it left with what an evacuator draws (laparoscopic_cautery, 12 s), in one of 1/120 s as much as
/// in this [s].
constexpr double kLongestTurn = 1.0 / 60.0;

/// One part of a frame, which ends at `time`.
struct Turn {
  double time = 0.0, dt = 0.0;  // [s]
  double from = 0.0, to = 1.0;  // of the frame
};

/// Its share of what leaves in the frame -> particles of the smoke volumes, the gas.
void give_share(World& world, const Turn& turn, FrameReport& report) {
  const FrameEmissions& emissions = *world.one<FrameEmissions>();
  const double share = turn.to - turn.from;
  for (GasSource source : emissions.gas) {
    source.impulse *= share;
    source.gift *= share;
    give_to_gas(world, source);
  }
  for (const FrameEmissions::Jet& jet : emissions.jets)
    emit_owed(*world.find<SmokeBody>(jet.volume), jet, share, turn.dt, report);
}

void take_turn(World& world, const Turn& turn, const std::vector<SmokeObstacle>& tools,
               FrameReport& report) {
  give_share(world, turn, report);
  advance_cavity(world, turn.time, turn.dt);
  const std::vector<SmokeOutlet> outlets = gas_outlets(world, turn.time);
  bool airborne = false;
  for (const SmokeBody& smoke : world.all<SmokeBody>())
    airborne |= smoke.volume.particles().size() > 0;
  // Gas that carries nothing isn't moved: it costs nothing until the first smoke.
  const GasGrid* grid = world.one<GasBody>()->grid.get();
  GasGrid* flow =
      airborne || (grid && grid->holds_any()) ? open_gas(world, outlets, turn.time) : nullptr;
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < sources.size(); ++s) {
    SmokeBody& smoke = *world.find<SmokeBody>(sources.owner(s));
    SmokeSurroundings around;
    around.outlets = outlets;
    around.from = turn.from;
    around.to = turn.to;
    std::vector<SmokeSurface> surfaces;
    std::optional<GasAround> gas;
    if (smoke.volume.particles().size() > 0) {
      surfaces = surfaces_near(world, sources[s].description.domain);
      around.surfaces = surfaces;
      around.obstacles = tools;
      if (flow) around.gas = &gas.emplace(*flow, sources[s].description.domain.min());
    }
    smoke.volume.step(turn.dt, around);
    smoke.most_particles =
        std::max<std::uint64_t>(smoke.most_particles, smoke.volume.particles().size());
  }
  if (flow) flow->step(turn.dt);
}

/// Smoke particles by [De2006] eq. 14, and the gas that they stir.
void move_smoke(World& world, const FrameContext& context) {
  const std::vector<SmokeObstacle> tools = tools_now(world);
  // Frames are whole milliseconds, some a little longer than a sixtieth of a second.
  const auto turns = static_cast<int>(std::max(1.0, std::round(context.dt / kLongestTurn)));
  for (int t = 0; t < turns; ++t) {
    const double from = static_cast<double>(t) / turns, to = static_cast<double>(t + 1) / turns;
    take_turn(world, {context.time - (1.0 - to) * context.dt, context.dt / turns, from, to}, tools,
              *context.report);
  }
}

/// Before what else isn't finite becomes zero.
void end_stray_smoke(World& world, Entity volume) {
  world.find<SmokeBody>(volume)->volume.end_strays();
}

}  // namespace

Feature smoke_feature() {
  return {.name = "smoke",
          .keys = smoke_keys(),
          .prepare = prepare_smoke,
          .finish = load_sight,
          .start = start_smoke,
          .states = {state_type<SmokeBody>({.contain = end_stray_smoke}), state_type<SmokeTools>()},
          .stages = {{.name = "emit smoke",
                      .reads = {"heat", "shapes", "organ poses"},
                      .writes = {"emissions"},
                      .changes = {"gas"},
                      .needed = smokes,
                      .run = emit_smoke},
                     {.name = "move smoke",
                      .reads = {"emissions", "shapes", "organ poses", "tool poses"},
                      .writes = {"smoke", "gas"},
                      .changes = {"smoke", "smoke tools", "gas"},
                      .needed = smokes,
                      .run = move_smoke}},
          .flags = {kSmokeFull, kSmokeOutside},
          .replaced = meet_what_is_left,
          .report = smoke_report,
          .warnings = smoke_warnings,
          .skipped = smoke_skipped};
}

}  // namespace viscera
