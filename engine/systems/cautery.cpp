// First version of cautery: the burn deposits energy in rest-space bricks, smoke follows the energy
// that tissue absorbed. The physics of heat and vaporisation replaces both behind these two stages.
#include <algorithm>
#include <utility>

#include "engine/systems/systems.h"
#include "engine/systems/tool_shape.h"

namespace viscera {
namespace {

/// Smoke particles for a watt of absorbed power and a second: 40 W give about 1,600 a second.
constexpr double kParticlesPerJoule = 40.0;
/// Speed at which vapour leaves the tissue [m/s], and its excess temperature [K].
constexpr double kJetSpeed = 0.12;
constexpr double kJetExcess = 60.0;
/// A trace that jumps further than this within a frame is two burns [m].
constexpr double kTraceBreak = 5e-3;

/// The heated ball is wider than the wire: current spreads into the tissue around the contact.
BurnParameters burn_parameters(const InstrumentDescription& hook) {
  BurnParameters parameters;
  parameters.radius = 1.5 * std::max(hook.tip.radius, kPointTipRadius);
  return parameters;
}

SmokeBody* volume_around(World& world, const Vec3& point) {
  for (SmokeBody& smoke : world.smoke)
    if (smoke.description.domain.contains(point)) return &smoke;
  return nullptr;
}

}  // namespace

void heat_tissue(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.burn_traces.size(); ++i) {
    const Entity instrument = world.burn_traces.owner(i);
    BurnTrace& trace = world.burn_traces[i];
    const InstrumentState& tool = *world.instrument_states.find(instrument);
    const InstrumentContact& contact = *world.instrument_contacts.find(instrument);
    trace.absorbed = 0.0;
    if (tool.power <= 0.0 || !contact.touching) {
      trace.burning = false;
      continue;
    }
    OrganBurn* burn = world.organ_burns.find(contact.organ);
    if (!burn) burn = &world.organ_burns.add(contact.organ, OrganBurn());
    const bool continues = trace.burning && trace.organ == contact.organ &&
                           (trace.rest_point - contact.rest_point).norm() < kTraceBreak;
    const Vec3 from = continues ? trace.rest_point : contact.rest_point;
    trace.absorbed =
        deposit_burn(burn->damage, from, contact.rest_point, tool.power, context.dt,
                     burn_parameters(world.instrument_bodies.find(instrument)->description));
    burn->energy += trace.absorbed;
    ++burn->version;
    trace.organ = contact.organ;
    trace.rest_point = contact.rest_point;
    trace.burning = true;
  }
}

void emit_smoke(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.burn_traces.size(); ++i) {
    const BurnTrace& trace = world.burn_traces[i];
    if (trace.absorbed <= 0.0) continue;
    const InstrumentContact& contact = *world.instrument_contacts.find(world.burn_traces.owner(i));
    SmokeBody* smoke = volume_around(world, contact.world_point);
    if (!smoke) {
      context.report->raise(FrameFlag::kSmokeOutside);
      continue;
    }
    const Tissue& tissue = world.organ_bodies.find(trace.organ)->tissue;
    smoke->particles_owed += trace.absorbed * kParticlesPerJoule * tissue.smoke_factor;
    SmokeEmission emission;
    emission.particles = static_cast<int>(smoke->particles_owed);
    smoke->particles_owed -= emission.particles;
    emission.position = contact.world_point + 0.5e-3 * contact.world_normal;
    emission.direction = contact.world_normal;
    emission.speed = kJetSpeed;
    emission.temperature = kJetExcess;
    emission.duration = context.dt;
    emission.mass = trace.absorbed * smoke->description.smoke_yield * tissue.smoke_factor;
    // Mass goes with particles; a frame that owes none carries its mass to the next with it.
    smoke->mass_owed += emission.mass;
    if (emission.particles == 0) continue;
    emission.mass = std::exchange(smoke->mass_owed, 0.0);
    const std::uint64_t crowded_out = smoke->volume.counters().crowded_out;
    smoke->volume.emit(emission);
    if (smoke->volume.counters().crowded_out > crowded_out)
      context.report->raise(FrameFlag::kSmokeFull);
  }
}

void move_smoke(World& world, const FrameContext& context) {
  for (SmokeBody& smoke : world.smoke) {
    if (smoke.volume.particles().size() == 0) continue;
    smoke.volume.step(context.dt);
    smoke.most_particles = std::max(smoke.most_particles, smoke.volume.particles().size());
  }
}

void check_world(World& world, const FrameContext& context) {
  for (const OrganState& state : world.organ_states)
    if (state.frozen) context.report->raise(FrameFlag::kOrganFrozen);
}

}  // namespace viscera
