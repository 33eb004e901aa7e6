#include "engine/features/local/local.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/features/local/hive_settings.h"

namespace viscera {
namespace {

/// A hive tells of the whole surface, but far from the tip its half-space isn't the body any more:
/// between these distances from the tip [radii of the hive] what it says fades out.
constexpr double kFadesFrom = 2.0, kFadesTo = 4.0;
/// Surface that faces away from the tip's side belongs to another side of the body.
constexpr double kFacesAway = -0.2;

double fading(double distance, double radius) {
  const double s = std::clamp((kFadesTo - distance / radius) / (kFadesTo - kFadesFrom), 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

/// Adds to the rest shape what one tool's hive says.
void add_dent(const HiveTissue& tissue, const OrganModel& model, const WalkableSurface& walkable,
              std::vector<Vec3f>& positions) {
  const Hive* hive = tissue.hive();
  if (!hive) return;
  const double radius = hive->settings().radius;
  const Vec3 centre = tissue.foot().spot().position, up = tissue.foot().up();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Vec3& rest = model.surface.vertices[v];
    const double distance = (rest - centre).norm();
    if (distance >= kFadesTo * radius) continue;
    const Vec3& normal = walkable.normals()[v];
    if (normal.dot(up) < kFacesAway) continue;
    SurfaceSpot spot;
    spot.position = rest;
    spot.normal = normal;
    positions[v] += (fading(distance, radius) * tissue.displacement(spot)).cast<float>();
  }
}

void update_surface(World& world, Entity entity, LocalSurface& local) {
  OrganState& state = *world.find<OrganState>(entity);
  const OrganBody& body = *world.find<OrganBody>(entity);
  double greatest = 0.0;
  for (std::size_t v = 0; v < state.positions.size(); ++v)
    greatest = std::max(
        greatest, static_cast<double>((state.positions[v] - body.model->rest_positions[v]).norm()));
  state.greatest_displacement = greatest;
  state.deformed = greatest > 0.0;
  ++state.version;
  local.surface->update(state.positions);
}

void take_rest_shape(World& world, Entity entity, LocalSurface& local) {
  OrganState& state = *world.find<OrganState>(entity);
  if (!state.pressed) return;
  const OrganModel& model = *world.find<OrganBody>(entity)->model;
  state.positions = model.rest_positions;
  state.normals = model.rest_normals;
  state.normals_fit = true;
  state.pressed = false;
  update_surface(world, entity, local);
}

void take_pressed_shape(World& world, Entity entity, const LocalOrgan& local,
                        LocalSurface& surface) {
  OrganState& state = *world.find<OrganState>(entity);
  const OrganModel& model = *world.find<OrganBody>(entity)->model;
  OrganDraft& draft = *world.find<OrganDraft>(entity);
  const WalkableSurface& walkable = *world.find<LocalBody>(entity)->walkable;
  draft.positions = model.rest_positions;
  for (const LocalOrgan::Touch& touch : local.touches)
    if (touch.pressing) add_dent(*touch.tissue, model, walkable, draft.positions);
  TriangleSurface shape{.vertices = {}, .triangles = model.surface.triangles};
  shape.vertices.reserve(draft.positions.size());
  for (const Vec3f& p : draft.positions) shape.vertices.push_back(p.cast<double>());
  std::vector<Vec3f> normals;
  normals.reserve(shape.vertices.size());
  bool finite = true;
  for (const Vec3& n : vertex_normals(shape)) {
    normals.push_back(n.cast<float>());
    finite = finite && n.allFinite();
  }
  if (!finite) {
    state.frozen = true;
    return;
  }
  state.positions.swap(draft.positions);
  state.normals.swap(normals);
  state.normals_fit = true;
  state.pressed = true;
  update_surface(world, entity, surface);
}

/// What the tip does to the tissue and the tissue to the tip.
void press(World& world, Entity entity, LocalSurface& local, LocalOrgan::Touch& touch,
           const FrameContext& context) {
  const Pose& pose = pose_of(world, entity);
  InstrumentState& state = *world.find<InstrumentState>(touch.instrument);
  TissueSnapshot& snapshot = touch.tissue->snapshots().back();
  snapshot.frame = context.frame;
  snapshot.tick = last_tick_of_frame(context.frame);
  snapshot.pose = pose;
  const double reach = touch.tissue->reach();
  const auto hit = local.surface->closest(pose.to_local(state.tip), reach);
  snapshot.nearest = hit ? hit->point : SurfacePoint();
  touch.tissue->snapshots().publish();
  const ToolMotion motion{
      {state.tip, Quaternion::Identity()}, (state.tip - touch.tip) / context.dt, 0, snapshot.tick};
  const TactileForce felt = touch.tissue->respond(motion, context.dt);
  touch.tip = state.tip;
  touch.pressing = felt.touching;
  touch.force = -felt.force;
  if (!felt.touching) return;
  InstrumentContact& tool = *world.find<InstrumentContact>(touch.instrument);
  tool.force += felt.force;
  const double strength = felt.force.norm();
  if (strength <= tool.strongest) return;
  const ToolFoot& foot = touch.tissue->foot();
  tool.touching = true;
  tool.strongest = strength;
  tool.organ = entity;
  tool.rest_point = foot.spot().position;
  tool.world_point =
      state.tip - touch.tissue->settings().tool_radius * pose.direction_to_world(foot.up());
  tool.world_normal = pose.direction_to_world(foot.up());
}

Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  Error error;
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    if (scene.organs[o].response != Response::kLocal || !scene.organs[o].deformable) continue;
    const Entity organ = model.organs()[o];
    auto walkable =
        WalkableSurface::make(model.constants().all<OrganBody>().find(organ)->model->surface);
    if (!walkable) {
      error.messages.push_back(fmt::format("{}: organs/{}/response: {}", scene.file.string(), o,
                                           walkable.error().text()));
      continue;
    }
    model.constants().all<LocalBody>().add(
        organ, {std::make_shared<const WalkableSurface>(std::move(*walkable))});
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

Result<void> start(World& world) {
  const SceneDescription& scene = world.model().scene();
  const Pool<LocalBody>& bodies = world.all<LocalBody>();
  Error error;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Entity organ = bodies.owner(b);
    const OrganBody& body = *world.find<OrganBody>(organ);
    const auto o = static_cast<std::size_t>(organ.index);
    LocalOrgan local;
    for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
      auto settings = hive_settings(scene.instruments[i], body, HiveBuilding::kInLockstep);
      if (!settings) {
        error.messages.push_back(
            fmt::format("{}: instruments/{}/{}", scene.file.string(), i, settings.error().text()));
        continue;
      }
      auto tissue = HiveTissue::create({bodies[b].walkable.get(), nullptr, nullptr}, *settings);
      if (!tissue) {
        error.messages.push_back(
            fmt::format("{}: organs/{}: {}", scene.file.string(), o, tissue.error().text()));
        continue;
      }
      LocalOrgan::Touch touch;
      touch.instrument = world.model().instruments()[i];
      touch.tissue = std::move(*tissue);
      touch.tip = scene.instruments[i].path.front().tip;
      local.touches.push_back(std::move(touch));
    }
    world.all<LocalOrgan>().add(organ, std::move(local));
    world.all<LocalSurface>().add(organ, {std::make_unique<CollisionSurface>(
                                             body.model->surface, body.model->rest_positions)});
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

/// Tips -> forces, OrganState, deformed surfaces of local organs. One without a tip near costs a
/// test for each instrument.
void deform_local_organs(World& world, const FrameContext& context) {
  Pool<LocalOrgan>& locals = world.all<LocalOrgan>();
  for (std::size_t o = 0; o < locals.size(); ++o) {
    const Entity organ = locals.owner(o);
    LocalSurface& surface = *world.find<LocalSurface>(organ);
    if (world.find<OrganState>(organ)->frozen) continue;
    bool pressed = false;
    for (LocalOrgan::Touch& touch : locals[o].touches) {
      press(world, organ, surface, touch, context);
      pressed = pressed || touch.pressing;
    }
    if (pressed)
      take_pressed_shape(world, organ, locals[o], surface);
    else
      take_rest_shape(world, organ, surface);
  }
}

void restored(World& world) {
  Pool<LocalSurface>& surfaces = world.all<LocalSurface>();
  for (std::size_t o = 0; o < surfaces.size(); ++o)
    surfaces[o].surface->update(world.find<OrganState>(surfaces.owner(o))->positions);
}

}  // namespace

Feature local_feature() {
  return {.name = "local",
          .prepare = prepare,
          .start = start,
          .states = {state_type<LocalOrgan>()},
          .stages = {{.name = "deform local organs",
                      .reads = {"tool poses", "organ poses", "forces", "shapes"},
                      .writes = {"forces", "shapes"},
                      .needed = [](const World& world) { return world.has<LocalOrgan>(); },
                      .run = deform_local_organs}},
          .restored = restored};
}

}  // namespace viscera
