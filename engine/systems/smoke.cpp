// Smoke: what comes from burns and from steady sources, and the gas that carries it.
#include <algorithm>
#include <array>
#include <utility>

#include "engine/systems/systems.h"
#include "kernels/smoke/gas_around.h"
#include "kernels/smoke/solid_cells.h"

namespace viscera {
namespace {

/// Speed at which vapour leaves the tissue [m/s].
constexpr double kJetSpeed = 0.12;
/// And how far over it, it is seen first [m].
constexpr double kOverTissue = 0.5e-3;
/// Organs within this distance of a volume are looked at for its particles: more than tissue moves
/// in a run [m].
constexpr double kObstacleMargin = 30e-3;
/// Cells of the gas are marked afresh when an organ has moved by this share of one.
constexpr double kStaleSolid = 0.25;

/// Whole particles go out with all the mass that is owed; a frame that owes none carries its mass
/// to the next with it.
void emit_owed(SmokeBody& smoke, SmokeEmitter& emitter, SmokeEmission emission, double particles,
               double mass, const FrameContext& context) {
  emitter.particles_owed += particles;
  emitter.mass_owed += mass;
  emission.particles = static_cast<int>(emitter.particles_owed);
  if (emission.particles == 0) return;
  emitter.particles_owed -= emission.particles;
  emission.mass = std::exchange(emitter.mass_owed, 0.0);
  emission.duration = context.dt;
  const std::uint64_t crowded_out = smoke.volume.counters().crowded_out;
  smoke.volume.emit(emission);
  if (smoke.volume.counters().crowded_out > crowded_out)
    context.report->raise(FrameFlag::kSmokeFull);
}

struct Fed {
  SmokeBody* smoke;
  SmokeEmitter* emitter;
};

/// The volumes into which a hook's burn at this place smokes: those that name it, or the first that
/// takes any.
std::vector<Fed> fed_by(World& world, Entity hook, const Vec3& place) {
  std::vector<Fed> named, any;
  for (SmokeBody& smoke : world.smoke) {
    if (!smoke.description.domain.contains(place)) continue;
    for (SmokeEmitter& emitter : smoke.emitters)
      if (emitter.instrument == hook)
        (smoke.takes_any_hook ? any : named).push_back({&smoke, &emitter});
  }
  if (named.empty() && !any.empty()) named.push_back(any.front());
  return named;
}

/// What left one brick of tissue in this frame.
struct Puff {
  BrickIndex brick;
  Vec3 place = Vec3::Zero();  ///< mean by mass, rest frame [m]
  double mass = 0.0;          ///< of smoke [kg]
  double temperature = 0.0;   ///< mean by mass [K]
};

std::vector<Puff> puffs_of(const Bioheat& heat) {
  std::vector<Puff> puffs;
  for (const Vapour& vapour : heat.vapour()) {
    const double mass = heat.smoke(vapour);
    if (mass <= 0.0) continue;
    const BrickIndex brick = BrickField::brick_of(heat.bricks().voxel_of(vapour.position));
    // Vapour comes in order of bricks.
    if (puffs.empty() || puffs.back().brick != brick) puffs.push_back({.brick = brick});
    Puff& puff = puffs.back();
    puff.mass += mass;
    puff.place += mass * vapour.position;
    puff.temperature += mass * vapour.temperature;
  }
  for (Puff& puff : puffs) {
    puff.place /= puff.mass;
    puff.temperature /= puff.mass;
  }
  return puffs;
}

/// Where vapour from a place in the tissue at rest comes out of the surface as it is now.
SmokeEmission outlet_of(const World& world, Entity organ, const OrganBurn& burn, const Vec3& rest) {
  const OrganBody& body = *world.organ_bodies.find(organ);
  const std::vector<Vec3f>& now = world.organ_states.find(organ)->positions;
  const SurfacePoint at = burn.surface->closest(rest).point;
  const auto& corners = body.model->surface.triangles[static_cast<std::size_t>(at.triangle)];
  std::array<Vec3, 3> corner;
  Vec3 place = Vec3::Zero();
  for (std::size_t c = 0; c < 3; ++c) {
    corner[c] = now[static_cast<std::size_t>(corners[c])].cast<double>();
    place += at.weights[static_cast<int>(c)] * corner[c];
  }
  const Vec3 across = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  SmokeEmission emission;
  emission.direction = body.pose.direction_to_world(across.norm() > 0.0 ? Vec3(across.normalized())
                                                                        : Vec3(Vec3::UnitZ()));
  emission.position = body.pose.to_world(place) + kOverTissue * emission.direction;
  emission.speed = kJetSpeed;
  return emission;
}

void emit_burns(World& world, Entity organ, const OrganBurn& burn, const FrameContext& context) {
  for (const Puff& puff : puffs_of(burn.heat)) {
    SmokeEmission emission = outlet_of(world, organ, burn, puff.place);
    emission.temperature = puff.temperature - world.gas.description.temperature;
    const std::vector<Fed> volumes = fed_by(world, burn.hook, emission.position);
    if (volumes.empty()) context.report->raise(FrameFlag::kSmokeOutside);
    for (const auto& [smoke, emitter] : volumes) {
      const double mass = puff.mass / static_cast<double>(volumes.size());
      emit_owed(*smoke, *emitter, emission, mass / smoke->description.particle_mass, mass, context);
    }
  }
}

void emit_steadily(SmokeBody& smoke, SmokeEmitter& emitter, const FrameContext& context) {
  const EmitterDescription& place = emitter.description;
  if (!place.when.contains(context.time)) return;
  SmokeEmission emission;
  emission.position = place.position;
  emission.direction = place.direction;
  emission.speed = place.speed;
  emission.radius = place.radius;
  emission.temperature = place.excess;
  emit_owed(smoke, emitter, emission, place.particles * context.dt, place.rate * context.dt,
            context);
}

// --- what smoke meets ---------------------------------------------------------------------------

const SurfaceTopology& topology_of(SmokeScenery& scenery, const TriangleSurface& surface) {
  std::unique_ptr<SurfaceTopology>& topology = scenery.topologies[&surface];
  if (!topology) {
    std::vector<Eigen::Vector3i> triangles;
    triangles.reserve(surface.triangles.size());
    for (const std::array<int, 3>& t : surface.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    topology = std::make_unique<SurfaceTopology>(std::move(triangles));
  }
  return *topology;
}

std::vector<SmokeSurface> surfaces_near(World& world, const Box& domain) {
  std::vector<SmokeSurface> surfaces;
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    const Entity organ = world.organ_bodies.owner(o);
    const OrganBody& body = world.organ_bodies[o];
    Box bounds;
    for (int corner = 0; corner < 8; ++corner)
      bounds.extend(
          body.pose.to_world(body.model->rest_bounds.corner(static_cast<Box::CornerType>(corner))));
    if (domain.exteriorDistance(bounds) > kObstacleMargin) continue;
    const OrganState& state = *world.organ_states.find(organ);
    surfaces.push_back({organ.index, &topology_of(world.smoke_scenery, body.model->surface),
                        state.positions, body.pose, state.version + 1});
  }
  return surfaces;
}

/// The instruments' shafts, each where it is and where it was a frame ago.
std::vector<SmokeObstacle> tools_now(World& world) {
  std::vector<SmokeObstacle> tools;
  const std::vector<SmokeObstacle>& before = world.smoke_scenery.tools;
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i) {
    const Entity instrument = world.instrument_bodies.owner(i);
    const InstrumentDescription& body = world.instrument_bodies[i].description;
    const InstrumentState& state = *world.instrument_states.find(instrument);
    SmokeObstacle tool;
    tool.from = state.tip;
    tool.to = body.trocar;
    tool.from_before = i < before.size() ? before[i].from : tool.from;
    tool.to_before = i < before.size() ? before[i].to : tool.to;
    tool.radius = body.shaft_radius;
    tools.push_back(tool);
  }
  world.smoke_scenery.tools = tools;
  return tools;
}

// --- the gas ------------------------------------------------------------------------------------

void mark_organs(World& world) {
  GasBody& gas = world.gas;
  const double stale = kStaleSolid * gas.grid->spacing().minCoeff();
  const bool first = gas.solids.empty();
  bool moved = first;
  for (const GasBody::Solid& solid : gas.solids) {
    const Pose& pose = world.organ_bodies.find(solid.organ)->pose;
    moved = moved || (pose.position - solid.pose.position).norm() > stale ||
            pose.orientation.angularDistance(solid.pose.orientation) > 1e-2;
  }
  if (!moved) return;
  const SolidGrid grid{gas.grid->parameters().domain.min(), gas.grid->spacing(), gas.grid->cells()};
  std::vector<std::uint8_t> cells(grid.size(), 0);
  gas.solids.clear();
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    const Entity organ = world.organ_bodies.owner(o);
    const OrganBody& body = world.organ_bodies[o];
    mark_solid(world.organ_states.find(organ)->positions, body.model->surface.triangles, body.pose,
               grid, cells);
    gas.solids.push_back({organ, body.pose});
  }
  gas.grid->set_solids(cells);
}

void open_gas(World& world, std::span<const SmokeOutlet> outlets, double time) {
  GasBody& gas = world.gas;
  std::vector<GasInlet> inlets;
  for (const InletDescription& inlet : gas.description.inlets)
    inlets.push_back({inlet.position, inlet.direction, inlet.radius,
                      inlet.when.contains(time) ? inlet.flow : 0.0});
  gas.grid->set_inlets(inlets);
  std::vector<GasEvacuator> evacuators;
  for (const SmokeOutlet& outlet : outlets)
    if (!outlet.leak) evacuators.push_back({outlet.position, outlet.radius, outlet.flow});
  gas.grid->set_evacuators(evacuators);
}

/// Evacuators that draw now, and leaks with what flows out of them.
std::vector<SmokeOutlet> outlets_at(const World& world, double time) {
  const GasBody& gas = world.gas;
  std::vector<SmokeOutlet> outlets;
  double balance = 0.0;
  for (const InletDescription& inlet : gas.description.inlets)
    if (inlet.when.contains(time)) balance += inlet.flow;
  for (const GasBody::Evacuator& evacuator : gas.evacuators) {
    const EvacuatorDescription& suction = evacuator.description;
    if (!suction.when.contains(time)) continue;
    const InstrumentState* tool = world.instrument_states.find(evacuator.instrument);
    outlets.push_back({tool ? tool->tip : suction.position, suction.radius, suction.flow, false});
    balance -= suction.flow;
  }
  const std::vector<LeakDescription>& leaks = gas.description.leaks;
  for (std::size_t i = 0; i < leaks.size(); ++i) {
    // Without a flow that knows, what comes in and isn't drawn off leaves by all of them alike.
    const bool known = gas.grid && i < gas.grid->report().leaks.size();
    const double flow =
        known ? gas.grid->report().leaks[i] : balance / static_cast<double>(leaks.size());
    outlets.push_back({leaks[i].position, leaks[i].radius, std::max(0.0, flow), true});
  }
  return outlets;
}

}  // namespace

void emit_smoke(World& world, const FrameContext& context) {
  for (std::size_t b = 0; b < world.organ_burns.size(); ++b)
    emit_burns(world, world.organ_burns.owner(b), world.organ_burns[b], context);
  for (SmokeBody& smoke : world.smoke)
    for (SmokeEmitter& emitter : smoke.emitters)
      if (emitter.description.instrument.empty()) emit_steadily(smoke, emitter, context);
}

void move_smoke(World& world, const FrameContext& context) {
  const std::vector<SmokeObstacle> tools = tools_now(world);
  const std::vector<SmokeOutlet> outlets = outlets_at(world, context.time);
  bool airborne = false;
  for (const SmokeBody& smoke : world.smoke) airborne |= smoke.volume.particles().size() > 0;
  // Gas that carries nothing isn't moved: it costs nothing until the first smoke.
  const bool flows = airborne && world.gas.grid;
  if (flows) {
    mark_organs(world);
    open_gas(world, outlets, context.time);
  }
  for (SmokeBody& smoke : world.smoke) {
    SmokeSurroundings around;
    around.outlets = outlets;
    std::vector<SmokeSurface> surfaces;
    std::optional<GasAround> gas;
    if (smoke.volume.particles().size() > 0) {
      surfaces = surfaces_near(world, smoke.description.domain);
      around.surfaces = surfaces;
      around.obstacles = tools;
      if (flows) around.gas = &gas.emplace(*world.gas.grid, smoke.description.domain.min());
    }
    smoke.volume.step(context.dt, around);
    smoke.most_particles = std::max(smoke.most_particles, smoke.volume.particles().size());
  }
  if (flows) world.gas.grid->step(context.dt);
}

}  // namespace viscera
