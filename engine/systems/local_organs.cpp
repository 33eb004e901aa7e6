#include "engine/systems/local_organs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/systems/haptic_tools.h"

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

void update_surface(World& world, Entity entity, LocalOrgan& local) {
  OrganState& state = *world.organ_states.find(entity);
  const OrganBody& body = *world.organ_bodies.find(entity);
  double greatest = 0.0;
  for (std::size_t v = 0; v < state.positions.size(); ++v)
    greatest = std::max(
        greatest, static_cast<double>((state.positions[v] - body.model->rest_positions[v]).norm()));
  state.greatest_displacement = greatest;
  state.deformed = greatest > 0.0;
  ++state.version;
  local.surface->update(state.positions);
}

void take_rest_shape(World& world, Entity entity, LocalOrgan& local) {
  OrganState& state = *world.organ_states.find(entity);
  if (!state.pressed) return;
  const OrganModel& model = *world.organ_bodies.find(entity)->model;
  state.positions = model.rest_positions;
  state.normals = model.rest_normals;
  state.normals_fit = true;
  state.pressed = false;
  update_surface(world, entity, local);
}

void take_pressed_shape(World& world, Entity entity, LocalOrgan& local) {
  OrganState& state = *world.organ_states.find(entity);
  const OrganModel& model = *world.organ_bodies.find(entity)->model;
  state.next_positions = model.rest_positions;
  for (const LocalOrgan::Touch& touch : local.touches)
    if (touch.pressing) add_dent(*touch.tissue, model, *local.walkable, state.next_positions);
  TriangleSurface shape{.vertices = {}, .triangles = model.surface.triangles};
  shape.vertices.reserve(state.next_positions.size());
  for (const Vec3f& p : state.next_positions) shape.vertices.push_back(p.cast<double>());
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
  state.positions.swap(state.next_positions);
  state.normals.swap(normals);
  state.normals_fit = true;
  state.pressed = true;
  update_surface(world, entity, local);
}

/// What the tip does to the tissue and the tissue to the tip.
void press(World& world, Entity entity, LocalOrgan& local, LocalOrgan::Touch& touch,
           const FrameContext& context) {
  const OrganBody& body = *world.organ_bodies.find(entity);
  InstrumentState& state = *world.instrument_states.find(touch.instrument);
  TissueSnapshot& snapshot = touch.tissue->snapshots().back();
  snapshot.frame = context.frame;
  snapshot.tick = last_tick_of_frame(context.frame);
  snapshot.pose = body.pose;
  const double reach = touch.tissue->reach();
  const auto hit = local.surface->closest(body.pose.to_local(state.tip), reach);
  snapshot.nearest = hit ? hit->point : SurfacePoint();
  touch.tissue->snapshots().publish();
  const ToolMotion motion{
      {state.tip, Quaternion::Identity()}, (state.tip - touch.tip) / context.dt, 0, snapshot.tick};
  const TactileForce felt = touch.tissue->respond(motion, context.dt);
  touch.tip = state.tip;
  touch.pressing = felt.touching;
  touch.force = -felt.force;
  if (!felt.touching) return;
  InstrumentContact& tool = *world.instrument_contacts.find(touch.instrument);
  tool.force += felt.force;
  const double strength = felt.force.norm();
  if (strength <= tool.strongest) return;
  const ToolFoot& foot = touch.tissue->foot();
  tool.touching = true;
  tool.strongest = strength;
  tool.organ = entity;
  tool.rest_point = foot.spot().position;
  tool.world_point =
      state.tip - touch.tissue->settings().tool_radius * body.pose.direction_to_world(foot.up());
  tool.world_normal = body.pose.direction_to_world(foot.up());
}

}  // namespace

Result<void> add_local_organs(const SceneDescription& scene, World& world) {
  Error error;
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    if (scene.organs[o].response != Response::kLocal || !scene.organs[o].deformable) continue;
    const Entity organ = world.organ_bodies.owner(o);
    const OrganBody& body = world.organ_bodies[o];
    auto walkable = WalkableSurface::make(body.model->surface);
    if (!walkable) {
      error.messages.push_back(fmt::format("{}: organs/{}/response: {}", scene.file.string(), o,
                                           walkable.error().text()));
      continue;
    }
    LocalOrgan local;
    local.walkable = std::make_shared<const WalkableSurface>(std::move(*walkable));
    local.surface =
        std::make_unique<CollisionSurface>(body.model->surface, body.model->rest_positions);
    for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
      auto settings = hive_settings(scene.instruments[i], body, ServoClock::kLockstep);
      if (!settings) {
        error.messages.push_back(
            fmt::format("{}: instruments/{}/{}", scene.file.string(), i, settings.error().text()));
        continue;
      }
      auto tissue = HiveTissue::create({local.walkable.get(), nullptr, nullptr}, *settings);
      if (!tissue) {
        error.messages.push_back(
            fmt::format("{}: organs/{}: {}", scene.file.string(), o, tissue.error().text()));
        continue;
      }
      LocalOrgan::Touch touch;
      touch.instrument = world.instrument_bodies.owner(i);
      touch.tissue = std::move(*tissue);
      touch.tip = scene.instruments[i].path.front().tip;
      local.touches.push_back(std::move(touch));
    }
    world.local_organs.add(organ, std::move(local));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

void deform_local_organs(World& world, const FrameContext& context) {
  for (std::size_t o = 0; o < world.local_organs.size(); ++o) {
    LocalOrgan& local = world.local_organs[o];
    const Entity organ = world.local_organs.owner(o);
    if (world.organ_states.find(organ)->frozen) continue;
    bool pressed = false;
    for (LocalOrgan::Touch& touch : local.touches) {
      press(world, organ, local, touch, context);
      pressed = pressed || touch.pressing;
    }
    if (pressed)
      take_pressed_shape(world, organ, local);
    else
      take_rest_shape(world, organ, local);
  }
}

std::optional<CollisionSurface::Hit> nearest_tissue(const World& world, Entity organ,
                                                    const Vec3& at, double radius) {
  const CollisionSurface* surface = nullptr;
  if (const OrganContact* contact = world.organ_contacts.find(organ)) {
    // Embree's boxes are fitted again by who asks: not for what is far.
    if (contact->bounds.exteriorDistance(at) > radius) return std::nullopt;
    surface = contact->surface.get();
  }
  if (const LocalOrgan* local = world.local_organs.find(organ)) surface = local->surface.get();
  if (!surface || world.organ_states.find(organ)->frozen) return std::nullopt;
  return surface->closest(world.organ_bodies.find(organ)->pose.to_local(at), radius);
}

}  // namespace viscera
