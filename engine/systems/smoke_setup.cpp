#include "engine/systems/smoke_setup.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/io/report.h"

namespace viscera {
namespace {

/// Of a particle with the passes' arrays, and of a voxel of the written volume.
constexpr std::size_t kBytesPerParticle = 320;
constexpr std::size_t kBytesPerVoxel = (2 + 3) * sizeof(float) + 5 * sizeof(std::int64_t);
/// More of the machine's memory than this is refused.
constexpr double kMostMemory = 0.8;

Entity instrument_named(const World& world, const std::string& name) {
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i)
    if (world.instrument_bodies[i].description.name == name)
      return world.instrument_bodies.owner(i);
  return {};
}

std::vector<SmokeEmitter> emitters_of(const SmokeDescription& smoke, const World& world) {
  std::vector<SmokeEmitter> emitters;
  for (const EmitterDescription& emitter : smoke.emitters)
    emitters.push_back({emitter, instrument_named(world, emitter.instrument)});
  if (!smoke.emitters.empty()) return emitters;
  for (std::size_t i = 0; i < world.burn_traces.size(); ++i) {
    const Entity hook = world.burn_traces.owner(i);
    EmitterDescription emitter;
    emitter.instrument = world.instrument_bodies.find(hook)->description.name;
    emitters.push_back({emitter, hook});
  }
  return emitters;
}

SmokeParameters parameters_of(const SceneDescription& scene, const SmokeDescription& smoke) {
  SmokeParameters parameters;
  parameters.domain = smoke.domain;
  parameters.open_sides = kOpenAll;
  parameters.spacing = smoke.spacing;
  parameters.laplacian = smoke.laplacian;
  parameters.lifetime = smoke.lifetime;
  parameters.seed = scene.seed;
  parameters.max_particles = static_cast<std::size_t>(smoke.max_particles);
  parameters.gas_temperature = scene.gas.temperature;
  parameters.gas_density = scene.gas.density();
  parameters.cavity_volume = scene.gas.cavity;
  return parameters;
}

Result<void> add_gas(const SceneDescription& scene, World& world) {
  GasBody& gas = world.gas;
  gas.description = scene.gas;
  for (const EvacuatorDescription& evacuator : scene.gas.evacuators)
    gas.evacuators.push_back({evacuator, instrument_named(world, evacuator.instrument)});
  if (scene.gas.cells == 0) return {};
  GasParameters parameters;
  if (scene.gas.domain) {
    parameters.domain = *scene.gas.domain;
  } else {
    for (const SmokeDescription& smoke : scene.smoke) parameters.domain.extend(smoke.domain);
  }
  parameters.cells = scene.gas.cells;
  parameters.density = scene.gas.density();
  parameters.kinematic_viscosity = SmokeParameters().gas_viscosity / parameters.density;
  parameters.eddy_viscosity = SmokeParameters().eddy_viscosity;
  if (auto sound = check_gas(parameters); !sound) return sound;
  gas.grid.emplace(parameters);
  std::vector<GasLeak> leaks;
  for (const LeakDescription& leak : scene.gas.leaks) leaks.push_back({leak.position, leak.radius});
  gas.grid->set_leaks(leaks);
  return {};
}

}  // namespace

std::size_t smoke_memory(const SmokeDescription& smoke) {
  const double voxels = (smoke.domain.sizes() / smoke.voxel).array().ceil().prod();
  return static_cast<std::size_t>(smoke.max_particles) * kBytesPerParticle +
         static_cast<std::size_t>(voxels) * kBytesPerVoxel;
}

Result<void> add_smoke(const SceneDescription& scene, World& world) {
  if (scene.smoke.empty()) return {};
  const double most = kMostMemory * static_cast<double>(this_machine().memory_bytes);
  double needed = 0.0;
  for (std::size_t s = 0; s < scene.smoke.size(); ++s) {
    needed += static_cast<double>(smoke_memory(scene.smoke[s]));
    if (needed > most)
      return failure(fmt::format(
          "{}: smoke/{} (\"{}\"): found volumes that need {:.1f} GB with those before it, expected "
          "at most {:.1f} GB of this machine's memory: a greater voxel_mm, a smaller domain or "
          "fewer max_particles",
          scene.file.string(), s, scene.smoke[s].name, 1e-9 * needed, 1e-9 * most));
  }
  for (const SmokeDescription& smoke : scene.smoke) {
    SmokeBody body{.description = smoke,
                   .volume = SmokeVolume(parameters_of(scene, smoke)),
                   .takes_any_hook = smoke.emitters.empty(),
                   .emitters = emitters_of(smoke, world),
                   .most_particles = 0,
                   .grid = {},
                   .particle_places = {},
                   .particle_radii = {}};
    world.smoke.add(world.ids.create(), std::move(body));
  }
  return add_gas(scene, world);
}

}  // namespace viscera
