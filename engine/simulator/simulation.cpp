#include "engine/simulator/simulation.h"

#include "engine/features/cautery/cautery.h"
#include "engine/features/held_tools/held_tools.h"
#include "engine/features/smoke/smoke.h"
#include "engine/scene/load_scene.h"
#include "engine/simulator/build.h"
#include "engine/simulator/state_file.h"

namespace viscera {
namespace {

StepReport report_of(FrameReport frame) {
  return {.flags = std::move(frame.flags), .strays = std::move(frame.strays)};
}

}  // namespace

Model::Model(std::shared_ptr<const SceneModel> scene, std::vector<std::string> warnings)
    : scene_(std::move(scene)), warnings_(std::move(warnings)) {}

Result<Model> Model::load(const std::filesystem::path& file, const ModelOptions& options) {
  auto tissues = load_tissues(options.assets / "tissues.json");
  if (!tissues) return std::unexpected(tissues.error());
  SceneLoadOptions load{options.assets, options.search, options.overrides, feature_keys()};
  auto scene = load_scene(file, load);
  if (!scene) return std::unexpected(scene.error());
  const Progress progress = [&](double share, std::string_view what) {
    return !options.progress || options.progress(share, what);
  };
  std::vector<std::string> warnings;
  auto model =
      build_model(*scene, *tissues, {options.assets, options.use_cache}, progress, warnings);
  if (!model) return std::unexpected(model.error());
  return Model(*std::move(model), std::move(warnings));
}

const std::string& Model::name() const {
  return scene_->scene().name;
}

double Model::duration() const {
  return scene_->scene().duration;
}

double Model::time_step() const {
  return scene_->time_step();
}

std::vector<std::string> Model::organs() const {
  std::vector<std::string> names;
  for (const OrganDescription& organ : scene_->scene().organs) names.push_back(organ.name);
  return names;
}

std::vector<std::string> Model::tools() const {
  std::vector<std::string> names;
  for (const InstrumentDescription& tool : scene_->scene().instruments) names.push_back(tool.name);
  return names;
}

Result<Simulation> Simulation::create(const Model& model, const SimulationOptions& options) {
  auto world = start_world(model.scene());
  if (!world) return std::unexpected(world.error());
  if (options.hands == Hands::kLockstep)
    if (auto held = hold_tools(**world, {}); !held) return std::unexpected(held.error());
  return Simulation(*std::move(world));
}

Simulation::Simulation(std::unique_ptr<World> world) : world_(std::move(world)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

double Simulation::time() const {
  return world_->time();
}

std::uint64_t Simulation::frame() const {
  return world_->frame();
}

Controls Simulation::path_controls() const {
  return controls_of_paths(*world_, end_of_step(*world_));
}

StepReport Simulation::step() {
  return report_of(step_frame(*world_, path_controls(), trace_));
}

Result<StepReport> Simulation::step(const Controls& controls) {
  if (auto sound = check_controls(*world_, controls); !sound) return std::unexpected(sound.error());
  return report_of(step_frame(*world_, controls, trace_));
}

Result<Snapshot> Simulation::snapshot() const {
  if (auto savable = check_savable(*world_); !savable) return std::unexpected(savable.error());
  Snapshot snapshot;
  snapshot.state_ = std::make_shared<const std::vector<std::byte>>(world_->save_state());
  snapshot.model_ = world_->shared_model();
  snapshot.time_ = world_->time();
  return snapshot;
}

Result<void> Simulation::restore(const Snapshot& snapshot) {
  if (!snapshot.state_ || snapshot.model_ != world_->shared_model())
    return failure("restore: found a snapshot of another model, expected one of this simulation's");
  return world_->load_state(*snapshot.state_);
}

Result<void> Simulation::save(const std::filesystem::path& file) const {
  return save_state_file(file, *world_);
}

Result<void> Simulation::load(const std::filesystem::path& file) {
  return load_state_file(file, *world_);
}

std::string Simulation::hash() const {
  return world_->state_hash();
}

std::size_t Simulation::state_bytes() const {
  return world_->state_bytes();
}

SurfaceView Simulation::surface(std::size_t organ) const {
  const Entity entity = world_->model().organs().at(organ);
  return {world_->find<OrganState>(entity)->positions,
          world_->find<OrganBody>(entity)->model->surface.triangles, pose_of(*world_, entity)};
}

Vec3 Simulation::force(std::size_t tool) const {
  return world_->find<InstrumentContact>(world_->model().instruments().at(tool))->force;
}

Vec3 Simulation::tip(std::size_t tool) const {
  return world_->find<InstrumentState>(world_->model().instruments().at(tool))->tip;
}

HeatView Simulation::heat(std::size_t organ) const {
  const OrganBurn* burn = world_->find<OrganBurn>(world_->model().organs().at(organ));
  if (!burn) return {};
  return {burn->heat.options().body + burn->heat.greatest_excess(), burn->heat.coagulated_volume(),
          burn->heat.vaporised_water() + burn->heat.vaporised_tissue()};
}

double Simulation::airborne_smoke() const {
  double mass = 0.0;
  for (const SmokeBody& smoke : world_->all<SmokeBody>()) mass += smoke.volume.airborne();
  return mass;
}

}  // namespace viscera
