#include "engine/features/smoke/smoke_setup.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/features/cautery/cautery_keys.h"
#include "engine/features/gas/gas.h"
#include "engine/scene/smoke_material.h"
#include "kernels/smoke/droplet_optics.h"

namespace viscera {
namespace {

/// Of a particle with the passes' arrays, and of a voxel of the written volume.
constexpr std::size_t kBytesPerParticle = 320;
constexpr std::size_t kBytesPerVoxel = (2 + 3) * sizeof(float) + 5 * sizeof(std::int64_t);

std::vector<SmokeSource::Emitter> emitters_of(const SmokeDescription& smoke,
                                              const SceneModel& model) {
  std::vector<SmokeSource::Emitter> emitters;
  for (const EmitterDescription& emitter : smoke.emitters)
    emitters.push_back({emitter, model.instrument_named(emitter.instrument)});
  if (!smoke.emitters.empty()) return emitters;
  for (std::size_t i = 0; i < model.instruments().size(); ++i) {
    const InstrumentDescription& tool = model.scene().instruments[i];
    if (!carries_current(tool)) continue;
    EmitterDescription emitter;
    emitter.instrument = tool.name;
    emitters.push_back({emitter, model.instruments()[i]});
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
  const GasDescription& gas = gas_of(scene);
  parameters.gas_temperature = gas.temperature;
  parameters.gas_density = gas.mixture().density();
  parameters.gas_viscosity = gas::kViscosity;
  parameters.prandtl = gas::kViscosity / parameters.gas_density / gas.mixture().heat_diffusivity();
  // Waves up to twice a cell long: longer ones the grid has.
  if (const auto cell = gas_cell(scene)) parameters.eddies.wavelength = 2.0 / 1.5 * *cell;
  parameters.cavity_volume = gas.cavity;
  return parameters;
}

void add_topologies(SceneModel& model) {
  SmokeScenery scenery;
  for (const OrganBody& body : model.constants().all<OrganBody>()) {
    const TriangleSurface& surface = body.model->surface;
    auto& topology = scenery.topologies[&surface];
    if (!topology) topology = topology_of(surface);
  }
  model.constants().all<SmokeScenery>().add(kWhole, std::move(scenery));
}

}  // namespace

std::shared_ptr<const SurfaceTopology> topology_of(const TriangleSurface& surface) {
  std::vector<Eigen::Vector3i> triangles;
  triangles.reserve(surface.triangles.size());
  for (const std::array<int, 3>& t : surface.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  return std::make_shared<const SurfaceTopology>(std::move(triangles));
}

std::size_t smoke_memory(const SmokeDescription& smoke) {
  const double voxels = (smoke.domain.sizes() / smoke.voxel).array().ceil().prod();
  return static_cast<std::size_t>(smoke.max_particles) * kBytesPerParticle +
         static_cast<std::size_t>(voxels) * kBytesPerVoxel;
}

Result<void> prepare_smoke(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  const std::span<const SmokeDescription> volumes = smoke_of(scene);
  if (volumes.empty()) return {};
  for (std::size_t s = 0; s < volumes.size(); ++s) {
    const std::size_t needed = smoke_memory(volumes[s]);
    auto fits = model.memory().check(
        needed, fmt::format("a volume of {} particles", volumes[s].max_particles),
        "a greater voxel_mm, a smaller domain or fewer max_particles");
    if (!fits)
      return failure(fmt::format("{}: smoke/{} (\"{}\"): {}", scene.file.string(), s,
                                 volumes[s].name, fits.error().text()));
    model.memory().keep(needed);
  }
  for (const SmokeDescription& smoke : volumes)
    model.constants().all<SmokeSource>().add(model.add_entity(),
                                             {.description = smoke,
                                              .parameters = parameters_of(scene, smoke),
                                              .takes_any_hook = smoke.emitters.empty(),
                                              .emitters = emitters_of(smoke, model)});
  add_topologies(model);
  return {};
}

Result<void> load_sight(SceneModel& model, const std::filesystem::path& assets,
                        std::vector<std::string>&) {
  if (smoke_of(model.scene()).empty()) return {};
  const auto material = load_smoke_material(assets / "smoke.json");
  if (!material) return std::unexpected(material.error());
  const GasMixture mixture = gas_of(model.scene()).mixture();
  model.constants().all<SmokeSight>().add(
      kWhole, {.optics = optics_of(material->droplets, material->wavelength),
               .fog = FogOptics(mixture, material->wavelength)});
  const double settling = settling_speed(material->droplets, mixture);
  for (SmokeSource& source : model.constants().all<SmokeSource>()) {
    SmokeParameters& parameters = source.parameters;
    // How long their waves are is the grid's, where there is one.
    const double wavelength = parameters.eddies.wavelength;
    parameters.eddies = material->eddies;
    if (gas_cell(model.scene())) parameters.eddies.wavelength = wavelength;
    parameters.jet_entrainment = material->jet_entrainment;
    parameters.deposition_velocity = settling;
  }
  return {};
}

Result<void> start_smoke(World& world) {
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < sources.size(); ++s)
    world.all<SmokeBody>().add(
        sources.owner(s), SmokeBody{.volume = SmokeVolume(sources[s].parameters),
                                    .debts = std::vector<SmokeDebt>(sources[s].emitters.size())});
  if (sources.size() > 0) world.all<SmokeTools>().add(kWhole, {});
  return {};
}

}  // namespace viscera
