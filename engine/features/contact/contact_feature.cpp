#include <algorithm>
#include <limits>

#include "engine/features/contact/contact.h"
#include "engine/features/contact/make_contact.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/jaws/jaws.h"

namespace viscera {
namespace {

Result<void> prepare(SceneModel& model) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    if (!model.scene().organs[o].deformable) continue;
    const Entity organ = model.organs()[o];
    const OrganModel& body = *model.constants().all<OrganBody>().find(organ)->model;
    model.constants().all<ScannedSurface>().add(organ, {SurfaceScan(body.surface)});
  }
  return {};
}

Result<void> start(World& world) {
  const SceneModel& scene = world.model();
  for (std::size_t o = 0; o < scene.organs().size(); ++o) {
    const Entity organ = scene.organs()[o];
    const OrganModel& model = *world.find<OrganBody>(organ)->model;
    const Pose pose = scene.scene().organs[o].pose_at(0.0);
    world.all<OrganPose>().add(organ, {pose});
    OrganTouch touch;
    touch.solver = make_contact(scene, organ);
    if (!touch.solver) continue;
    touch.bounds = bounds_at_rest(model, pose);
    world.all<OrganTouch>().add(organ, std::move(touch));
    OrganContact contact;
    contact.surface = std::make_unique<CollisionSurface>(model.surface, model.rest_positions);
    contact.rest = std::make_unique<CollisionSurface>(model.surface, model.rest_positions);
    world.all<OrganContact>().add(organ, std::move(contact));
  }
  return {};
}

/// A point of the drawn surface where tissue is now that was at this place at rest.
void put_on(const CollisionSurface& rest, const Vec3& place, SurfacePoint& point) {
  if (const auto hit = rest.closest(place, std::numeric_limits<double>::infinity()))
    point = hit->point;
}

/// Jaws and bags hold on to what is left of what they held; what has gone farther than this they
/// have lost.
constexpr double kHeldTissueLostBy = 1e-3;  // [m]

void hold_what_is_left(World& world, Entity instrument, const CollisionSurface& rest) {
  Grasp& grasp = *world.find<InstrumentContact>(instrument)->grasp;
  std::vector<char> left(grasp.cells.size(), 0);
  for (std::size_t k = 0; k < left.size(); ++k)
    if (const auto hit = rest.closest(grasp.cells[k].position, kHeldTissueLostBy)) {
      grasp.points[k] = hit->point;
      left[k] = 1;
    }
  keep_held(world, instrument, [&](std::size_t cell) { return left[cell] != 0; });
}

/// What touches an organ touches the same tissue of the body that it is now.
void replaced(World& world, Entity organ, const Continuation* continuation) {
  OrganTouch* touch = world.find<OrganTouch>(organ);
  OrganContact* contact = world.find<OrganContact>(organ);
  if (!touch || !contact) return;
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  contact->surface = std::make_unique<CollisionSurface>(model.surface, model.rest_positions);
  contact->rest = std::make_unique<CollisionSurface>(model.surface, model.rest_positions);
  world.all<RescannedSurface>().remove(organ);
  world.all<RescannedSurface>().add(organ, {SurfaceScan(model.surface)});
  auto solver = make_finite_contact(model);
  const auto* before = dynamic_cast<const FiniteContact*>(touch->solver.get());
  if (before && continuation) solver->go_on_from(*before, *continuation);
  touch->solver = std::move(solver);
  for (Cling& cling : touch->clings)
    for (Cling::Spot& spot : cling.spots) put_on(*contact->rest, spot.rest, spot.point);
  const Pool<InstrumentContact>& tools = world.all<InstrumentContact>();
  for (std::size_t t = 0; t < tools.size(); ++t)
    if (tools[t].grasp && tools[t].grasp->organ == organ)
      hold_what_is_left(world, tools.owner(t), *contact->rest);
}

/// A state that another program made may say anything.
void drop_unsound_grasps(World& world) {
  for (InstrumentContact& tool : world.all<InstrumentContact>()) {
    if (!tool.grasp) continue;
    const Grasp& grasp = *tool.grasp;
    const OrganBody* body = world.find<OrganBody>(grasp.organ);
    const bool sound = body && world.find<OrganContact>(grasp.organ) && !grasp.cells.empty() &&
                       grasp.points.size() == grasp.cells.size() &&
                       std::ranges::all_of(grasp.points, [&](const SurfacePoint& point) {
                         return point.triangle >= 0 && static_cast<std::size_t>(point.triangle) <
                                                           body->model->surface.triangles.size();
                       });
    if (!sound) tool.grasp.reset();
  }
}

void restored(World& world) {
  drop_unsound_grasps(world);
  Pool<OrganContact>& contacts = world.all<OrganContact>();
  for (std::size_t o = 0; o < contacts.size(); ++o)
    contacts[o].surface->update(world.find<OrganState>(contacts.owner(o))->positions);
}

}  // namespace

Box bounds_at_rest(const OrganModel& model, const Pose& pose) {
  Box bounds;
  for (int corner = 0; corner < 8; ++corner)
    bounds.extend(pose.to_world(model.rest_bounds.corner(static_cast<Box::CornerType>(corner))));
  return bounds;
}

void keep_held(World& world, Entity instrument, const std::function<bool(std::size_t)>& keeps) {
  std::optional<Grasp>& held = world.find<InstrumentContact>(instrument)->grasp;
  Jaws* jaws = world.find<Jaws>(instrument);
  const std::size_t upper_before = jaws ? jaws->upper : 0;
  std::vector<char> stays;
  for (std::size_t k = 0; k < held->cells.size(); ++k) stays.push_back(keeps(k));
  // What two jaws have between them they have from both sides: the one goes with the other.
  if (2 * upper_before == stays.size())
    for (std::size_t k = 0; k < upper_before; ++k)
      stays[k] = stays[upper_before + k] = stays[k] && stays[upper_before + k];
  std::size_t kept = 0, upper = 0;
  for (std::size_t k = 0; k < held->cells.size(); ++k) {
    if (!stays[k]) continue;
    if (k < upper_before) ++upper;
    held->cells[kept] = held->cells[k];
    held->points[kept++] = held->points[k];
  }
  held->cells.resize(kept);
  held->points.resize(kept);
  if (jaws) jaws->upper = upper;
  if (kept == 0 || (upper_before > 0 && (upper == 0 || upper == kept))) held.reset();
}

Vec3 cell_displacement(const World& world, Entity organ, std::size_t cell) {
  return pose_of(world, organ)
      .direction_to_world(world.find<OrganTouch>(organ)->solver->cell_displacements()[cell]);
}

Feature contact_feature() {
  return {.name = "contact",
          .prepare = prepare,
          .start = start,
          .states = {state_type<OrganPose>({Strays::Become::kAsBefore}),
                     state_type<OrganTouch>({.unchanged = all_stay})},
          .stages = {{.name = "find contacts",
                      .reads = {"tool poses", "organ poses"},
                      .reads_before = {"surfaces", "bags"},
                      .writes = {"contact cells"},
                      .changes = {"organ contacts", "tool forces", "jaws"},
                      .run = find_contacts},
                     {.name = "free cells",
                      .reads = {"contact cells", "free shapes"},
                      .writes = {"contact problem"},
                      .changes = {"organ contacts"},
                      .needed = [](const World& world) { return world.has<FreeShape>(); },
                      .run = [](World& world, const FrameContext&) { let_cells_move(world); }}},
          .flags = {kOutOfReach, kGripMissed},
          .replaced = replaced,
          .restored = restored};
}

}  // namespace viscera
