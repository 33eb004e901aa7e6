#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/features/gravity/gravity.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/finite/unloaded_shape.h"

namespace viscera {
namespace {

/// Displacements are linear in gravity: what turns by more than this share of the organ's size is
/// beyond what that describes.
constexpr double kLongSag = 0.1;

void reach(const SceneDescription& scene, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  const GravityDescription* gravity = gravity_of(scene);
  if (!gravity || !organ.deformable || !sags(organ)) return;
  if (gravity->changes()) reach.sags = true;
  if (hung_in_image(organ))
    reach.weight = organ.pose.direction_to_local(gravity->acceleration * gravity->rest_direction);
}

void warn_of_long_sags(const SceneDescription& scene, const OrganModels& models,
                       std::vector<std::string>& warnings) {
  if (!gravity_of(scene)) return;
  const Gravity gravity(*gravity_of(scene));
  for (std::size_t o = 0; o < models.size(); ++o) {
    const double size = models[o]->rest_bounds.sizes().maxCoeff();
    const double sag = greatest_sag(*models[o], scene.organs[o].pose, gravity, scene.duration);
    if (sag <= kLongSag * size) continue;
    warnings.push_back(fmt::format(
        "organ \"{}\": the change of gravity moves it by {:.0f} mm, more than a tenth of its size "
        "({:.0f} mm): elasticity is linear, the true way is shorter; tilt less, hold more of it, "
        "or raise youngs_modulus_kPa",
        scene.organs[o].name, 1e3 * sag, 1e3 * size));
  }
}

Result<void> prepare(SceneModel& model) {
  if (const GravityDescription* gravity = gravity_of(model.scene()))
    model.constants().all<TableGravity>().add(kWhole, {Gravity(*gravity)});
  return {};
}

Result<void> start(World& world) {
  const Pool<OrganBody>& bodies = world.all<OrganBody>();
  for (std::size_t o = 0; o < bodies.size(); ++o) {
    const OrganModel& model = *bodies[o].model;
    // At finite strain its weight is a term of the energy, and its own motion shows it.
    if (model.finite && sags(world.model().scene().organs[o]))
      world.all<OrganSag>().add(bodies.owner(o), {});
    if (model.sag.empty()) continue;
    world.all<OrganSag>().add(bodies.owner(o), {});
    world.all<FreeShape>().add(bodies.owner(o), level_shape(*bodies[o].model));
  }
  return {};
}

void sag_organs(World& world, const FrameContext& context) {
  const TableGravity* table = world.one<TableGravity>();
  const Vec3 change = table ? table->gravity.change_at(context.time) : Vec3::Zero();
  const Vec3 whole = table ? table->gravity.at(context.time) : Vec3::Zero();
  const auto& organs = world.model().scene().organs;
  Pool<OrganSag>& sags = world.all<OrganSag>();
  for (std::size_t o = 0; o < sags.size(); ++o) {
    const Entity organ = sags.owner(o);
    // Breathing moves an organ's frame without turning it.
    const Vec3 local =
        pose_of(world, organ).direction_to_local(organs[organ.index].free ? whole : change);
    if (local == sags[o].change) continue;
    sags[o].change = local;
    if (FreeShape* free = world.find<FreeShape>(sags.owner(o))) free->stale = true;
  }
}

bool shape(const World& world, Entity organ, std::vector<float>& places) {
  const OrganSag* sag = world.find<OrganSag>(organ);
  if (!sag || sag->change.isZero(0.0)) return false;
  add_sag(*world.find<OrganBody>(organ)->model, sag->change, places);
  return true;
}

std::vector<ReportSection> report(const World& world) {
  Json unloaded = Json::array();
  const Pool<OrganBody>& bodies = world.all<OrganBody>();
  for (std::size_t o = 0; o < bodies.size(); ++o) {
    const auto& finite = bodies[o].model->finite;
    if (!finite || farthest(finite->body().unloaded()) == 0.0) continue;
    unloaded.push_back(
        {{"organ", bodies[o].name}, {"unloaded_m", farthest(finite->body().unloaded())}});
  }
  if (unloaded.empty()) return {};
  return {report_section("gravity", unloaded)};
}

}  // namespace

Feature gravity_feature() {
  return {.name = "gravity",
          .keys = gravity_keys(),
          .reach = reach,
          .warn_of_models = warn_of_long_sags,
          .prepare = prepare,
          .start = start,
          .states = {state_type<OrganSag>()},
          .stages = {{.name = "sag organs",
                      .reads = {"organ poses"},
                      .writes = {"parts of free shapes"},
                      .changes = {"sagging organs", "free shapes"},
                      .needed = [](const World& world) { return world.has<OrganSag>(); },
                      .run = sag_organs}},
          .shape = shape,
          .report = report};
}

}  // namespace viscera
