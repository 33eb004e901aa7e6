#include "engine/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "engine/io/mesh_import.h"
#include "engine/scene/smoke_material.h"
#include "engine/systems/heat_setup.h"
#include "engine/systems/links.h"
#include "engine/systems/local_organs.h"
#include "engine/systems/smoke_setup.h"
#include "engine/systems/systems.h"
#include "engine/systems/tissue_changes.h"
#include "engine/systems/tool_shape.h"
#include "kernels/base/thin_out.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// Tissue this far from a tip's path may be touched: the width of a contact and of its spreading.
constexpr double kReachMargin = 8e-3;
/// Of a jaw's travel while closed, the share that tissue elsewhere on the organs may follow, and
/// the most that is allowed for.
constexpr double kCarriedShare = 0.5;
constexpr double kCarriedMost = 12e-3;
/// A link's pull is spread this far around its springs, in spacings of nodes.
constexpr double kSpreadSpacings = 2.6;
/// Paths are sampled at the frame rate and thinned to this distance [m].
constexpr double kPathPitch = 1e-3;
constexpr double kSampleStep = 1.0 / 60.0;
/// Tissue this far from a hook's path with current may coagulate: half of a wide lesion and what
/// the tip has carried along.
constexpr double kBurnMargin = 6e-3;
/// Vertices of a mesh tip within this distance of its end look for tissue [m].
constexpr double kMeshEnd = 8e-3;
constexpr std::size_t kMeshSamples = 200;
/// A tip that touches an organ at the start may be this deep in it [m].
constexpr double kStartsInside = 1e-4;

KeyFrames tip_path(const InstrumentDescription& instrument) {
  std::vector<double> times;
  std::vector<Vec3> tips;
  for (const InstrumentKey& key : instrument.path) {
    times.push_back(key.time);
    tips.push_back(key.tip);
  }
  return KeyFrames(std::move(times), std::move(tips));
}

KeyFrames jaw_path(const InstrumentDescription& instrument) {
  std::vector<double> times;
  std::vector<Vec3> jaws;
  for (const InstrumentKey& key : instrument.path) {
    times.push_back(key.time);
    jaws.emplace_back(key.jaw, 0.0, 0.0);
  }
  return KeyFrames(std::move(times), std::move(jaws));
}

Result<InstrumentBody> make_instrument(const InstrumentDescription& description) {
  InstrumentBody body;
  body.description = description;
  body.tip = tip_path(description);
  body.jaw = jaw_path(description);
  body.extent = std::max(description.tip.radius, kPointTipRadius) + description.tip.length;
  if (description.tip.shape != TipDescription::Shape::kMesh) return body;

  auto mesh = import_surface(description.tip.file, description.tip.unit);
  if (!mesh) return std::unexpected(mesh.error());
  body.mesh = std::move(*mesh);
  if (const double enclosed = volume(body.mesh); enclosed < 0.0)
    return failure(fmt::format(
        "{}: instrument \"{}\": the mesh is inside-out (it encloses {:.3g} mm3), expected "
        "triangles that run counter-clockwise as seen from outside",
        description.tip.file.string(), description.name, 1e9 * enclosed));
  std::vector<Vec3f> positions;
  double across = 0.0;
  for (const Vec3& v : body.mesh.vertices) {
    positions.push_back(v.cast<float>());
    if (v.norm() > kMeshEnd) continue;
    body.mesh_samples.push_back(v);
    across = std::max(across, v.head<2>().norm());
  }
  if (body.mesh_samples.empty())
    return failure(
        fmt::format("{}: instrument \"{}\": the mesh has no vertex within {:g} mm of its "
                    "origin, expected the tip there and the shaft along +z",
                    description.tip.file.string(), description.name, 1e3 * kMeshEnd));
  thin_out(body.mesh_samples, kMeshSamples);
  body.description.tip.radius = std::max(across, kPointTipRadius);
  body.extent = kMeshEnd;
  body.mesh_surface = std::make_unique<CollisionSurface>(body.mesh, positions);
  return body;
}

void add_organ(World& world, const OrganDescription& description, const Tissue& tissue,
               std::shared_ptr<const OrganModel> model) {
  const Entity organ = world.ids.create();
  const Pose pose = description.pose_at(0.0);
  if (description.motion) world.organ_motions.add(organ, {description.pose, *description.motion});
  OrganState state;
  state.positions = model->rest_positions;
  state.normals = model->rest_normals;
  state.displacements.assign(model->displacement_rows(), 0.0f);
  if (model->touchable_anywhere()) {
    OrganContact contact;
    contact.solver =
        std::make_unique<PatchContact>(model->compliance, model->touchable, model->material);
    contact.surface = std::make_unique<CollisionSurface>(model->surface, model->rest_positions);
    for (int corner = 0; corner < 8; ++corner)
      contact.bounds.extend(
          pose.to_world(model->rest_bounds.corner(static_cast<Box::CornerType>(corner))));
    world.organ_contacts.add(organ, std::move(contact));
  }
  if (!model->sag.empty()) world.organ_sags.add(organ, level_sag(*model));
  world.organ_bodies.add(organ, {description.name, tissue, pose, std::move(model)});
  world.organ_states.add(organ, std::move(state));
}

void add_instrument(World& world, InstrumentBody body) {
  const Entity instrument = world.ids.create();
  world.instrument_states.add(instrument, {});
  world.instrument_contacts.add(instrument, {});
  if (carries_current(body.description))
    world.burn_traces.add(instrument, BurnTrace{.tip = ElectrodeTip(electrode_of(body.description)),
                                                .organ = {},
                                                .contact = {},
                                                .current = {}});
  world.instrument_bodies.add(instrument, std::move(body));
}

/// Displacements are linear in gravity: what turns by more than this share of the organ's size is
/// beyond what that describes.
constexpr double kLongSag = 0.1;

void warn_of_long_sags(const SceneDescription& scene, const OrganModels& models,
                       std::vector<std::string>& warnings) {
  const Gravity gravity(*scene.gravity);
  for (std::size_t o = 0; o < models.size(); ++o) {
    const double size = models[o]->rest_bounds.sizes().maxCoeff();
    const double sag = greatest_sag(*models[o], scene.organs[o].pose, gravity, scene.duration);
    if (sag <= kLongSag * size) continue;
    warnings.push_back(fmt::format(
        "organ \"{}\": the change of gravity moves it by {:.0f} mm, more than a tenth of its size "
        "({:.0f} mm): elasticity is linear, the true way is shorter; tilt less, hold more of it, "
        "or "
        "raise youngs_modulus_kPa",
        scene.organs[o].name, 1e3 * sag, 1e3 * size));
  }
}

std::string buried_message(const SceneDescription& scene, std::size_t instrument,
                           const std::string& organ, double depth) {
  return fmt::format(
      "{}: instruments/{}/path/0/tip_mm: the tip starts {:.2f} mm inside organ \"{}\", expected a "
      "place outside every organ (move it at least {:.2f} mm)",
      scene.file.string(), instrument, 1e3 * depth, organ, 1e3 * depth);
}

/// Where a hook passes with current, in the organ's frame.
void add_burns(const InstrumentBody& hook, const OrganDescription& organ, Reach& reach) {
  reach.burn_radius = std::max(reach.burn_radius, kBurnMargin + hook.extent);
  Vec3 last = Vec3::Constant(std::numeric_limits<double>::infinity());
  const std::vector<InstrumentKey>& path = hook.description.path;
  for (double time = 0.0; time <= path.back().time + kSampleStep; time += kSampleStep) {
    if (path[hook.tip.key_at(time)].power <= 0.0) continue;
    const Vec3 local = organ.pose_at(time).to_local(hook.tip.at(time));
    if ((local - last).norm() < kPathPitch) continue;
    reach.burns.push_back(local);
    last = local;
  }
}

}  // namespace

Reach reach_of(const std::vector<InstrumentBody>& instruments, const SceneDescription& scene,
               const OrganDescription& organ) {
  Reach reach;
  // What hives alone answer for has nothing to prepare.
  if (organ.response == Response::kLocal) return reach;
  reach.sags = scene.gravity && scene.gravity->changes() && organ.deformable && organ.sags;
  double size = 0.0, carried = 0.0;
  for (const InstrumentBody& body : instruments) {
    const InstrumentDescription& instrument = body.description;
    size = std::max(size, body.extent);
    if (instrument.kind == InstrumentKind::kGrasper) size = std::max(size, instrument.grip_radius);
    bool closed = false;
    Vec3 closed_at = Vec3::Zero();
    Vec3 last = Vec3::Constant(std::numeric_limits<double>::infinity());
    // The whole path, so that a shorter run takes the same model from the cache.
    const double end = instrument.path.back().time + kSampleStep;
    for (double time = 0.0; time <= end; time += kSampleStep) {
      const Vec3 at = body.tip.at(time);
      // Behind a jaw that has closed the tissue moves along; it is the closing place that counts.
      const bool was_closed = closed;
      closed = instrument.kind == InstrumentKind::kGrasper &&
               jaw_closed(was_closed, body.jaw.at(time).x());
      if (closed && !was_closed) closed_at = at;
      if (closed) carried = std::max(carried, (at - closed_at).norm());
      // In the organ's frame, which may move under a tip that rests.
      const Vec3 local = organ.pose_at(time).to_local(at);
      if ((local - last).norm() < kPathPitch) continue;
      reach.points.push_back(local);
      last = local;
    }
    if (carries_current(instrument)) add_burns(body, organ, reach);
  }
  reach.radius = kReachMargin + size + std::min(kCarriedMost, kCarriedShare * carried);
  for (const LinkDescription& link : scene.links)
    if (link.stiffness > 0.0 && (link.between[0] == organ.name || link.between[1] == organ.name))
      reach.attachments.push_back(
          {link.region.grown(kSpreadSpacings * organ.resolution.finest), organ.pose});
  return reach;
}

Tissue tissue_of(const OrganDescription& organ, const std::map<std::string, Tissue>& tissues) {
  Tissue tissue = tissues.at(organ.tissue);
  if (organ.youngs_modulus) tissue.elastic.youngs_modulus = *organ.youngs_modulus;
  if (organ.poisson_ratio) tissue.elastic.poisson_ratio = *organ.poisson_ratio;
  tissue.model = organ.material.model;
  if (!organ.material.relaxes) tissue.prony = organ.material.prony;
  return tissue;
}

Result<std::vector<InstrumentBody>> make_instruments(const SceneDescription& scene) {
  std::vector<InstrumentBody> instruments;
  for (const InstrumentDescription& description : scene.instruments) {
    auto body = make_instrument(description);
    if (!body) return std::unexpected(body.error());
    instruments.push_back(std::move(*body));
  }
  return instruments;
}

Result<void> check_tips(const SceneDescription& scene,
                        const std::vector<InstrumentBody>& instruments,
                        const OrganDescription& organ, const TriangleSurface& surface) {
  Error buried;
  const Box box = bounds(surface);
  std::optional<SurfaceTree> tree;  // made when some tip is in the organ's box
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    InstrumentState state;
    place_tool(instruments[i], 0.0, state);
    const ToolShape tool = tool_shape(instruments[i], state, organ.pose_at(0.0));
    double deepest = 0.0;
    for (const Vec3& probe : tool.probes()) {
      if (box.exteriorDistance(probe) > tool.probe_radius()) continue;
      if (!tree) tree.emplace(surface);
      deepest = std::max(deepest, tool.probe_radius() - tree->signed_distance(probe));
    }
    if (deepest > kStartsInside)
      buried.messages.push_back(buried_message(scene, i, organ.name, deepest));
  }
  if (!buried.messages.empty()) return std::unexpected(buried);
  return {};
}

Result<OrganModels> prepare_organs(const SceneDescription& scene,
                                   const std::vector<InstrumentBody>& instruments,
                                   const std::map<std::string, Tissue>& tissues,
                                   const PrepareOptions& options, const Progress& progress,
                                   std::vector<std::string>& warnings) {
  OrganModels models;
  std::map<std::string, std::shared_ptr<const OrganModel>> shared;  // by key and storage
  const double organs = static_cast<double>(scene.organs.size());
  for (std::size_t i = 0; i < scene.organs.size(); ++i) {
    const OrganDescription& organ = scene.organs[i];
    const Tissue tissue = tissue_of(organ, tissues);
    const Reach reach = reach_of(instruments, scene, organ);
    const SurfaceInspection tips_are_clear = [&](const TriangleSurface& surface) {
      return check_tips(scene, instruments, organ, surface);
    };
    auto key = organ_key(organ, tissue, reach, options);
    if (!key) return std::unexpected(key.error());
    std::shared_ptr<const OrganModel>& model =
        shared[fmt::format("{} {}", *key, static_cast<int>(organ.displacement_storage))];
    if (model) {
      if (auto clear = tips_are_clear(model->surface); !clear)
        return std::unexpected(clear.error());
      models.push_back(model);
      continue;
    }
    const Progress part = [&](double fraction, std::string_view what) {
      return progress((static_cast<double>(i) + fraction) / organs,
                      fmt::format("{}: {}", organ.name, what));
    };
    auto prepared = prepare_organ(organ, tissue, reach, options, tips_are_clear, part, warnings);
    if (!prepared) {
      Error error = prepared.error();
      if (error.messages.size() == 1 && error.messages[0] == kCancelled)
        return std::unexpected(error);
      for (std::string& message : error.messages)
        if (!message.starts_with(scene.file.string()))
          message = fmt::format("{}: organs/{} (\"{}\"): {}", scene.file.string(), i, organ.name,
                                message);
      return std::unexpected(error);
    }
    model = std::move(*prepared);
    models.push_back(model);
  }
  if (scene.gravity) warn_of_long_sags(scene, models, warnings);
  return models;
}

Result<std::unique_ptr<World>> place_entities(const SceneDescription& scene,
                                              std::vector<InstrumentBody> instruments,
                                              const OrganModels& models,
                                              const std::map<std::string, Tissue>& tissues) {
  auto world = std::make_unique<World>();
  if (scene.gravity) world->gravity.emplace(*scene.gravity);
  for (std::size_t i = 0; i < scene.organs.size(); ++i)
    add_organ(*world, scene.organs[i], tissue_of(scene.organs[i], tissues), models[i]);
  for (InstrumentBody& body : instruments) add_instrument(*world, std::move(body));
  if (auto added = add_local_organs(scene, *world); !added) return std::unexpected(added.error());
  if (auto heated = add_heat(scene, *world); !heated) return std::unexpected(heated.error());
  if (auto filled = add_smoke(scene, *world); !filled) return std::unexpected(filled.error());
  if (auto linked = make_links(scene, *world); !linked) return std::unexpected(linked.error());
  return world;
}

Result<std::unique_ptr<World>> build_world(const SceneDescription& scene,
                                           const std::map<std::string, Tissue>& tissues,
                                           const PrepareOptions& options, const Progress& progress,
                                           std::vector<std::string>& warnings) {
  if (auto sound = check_materials(scene, tissues); !sound) return std::unexpected(sound.error());
  auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  auto models = prepare_organs(scene, *instruments, tissues, options, progress, warnings);
  if (!models) return std::unexpected(models.error());
  auto world = place_entities(scene, std::move(*instruments), *models, tissues);
  if (!world) return world;
  warn_of_cold_organs(scene, **world, options.assets / "tissues.json", warnings);
  if (scene.smoke.empty()) return world;
  const auto optics = load_smoke_optics(options.assets / "smoke.json");
  if (!optics) return std::unexpected(optics.error());
  (*world)->smoke_optics = *optics;
  return world;
}

}  // namespace viscera
