#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/linear_limits.h"
#include "engine/features/deformation/stages.h"
#include "engine/features/free_bodies/free_bodies.h"
#include "kernels/contact/surface_carriers.h"

namespace viscera {
namespace {

Result<void> prepare(SceneModel& model) {
  prepare_linear_limits(model);
  return {};
}

Result<void> start(World& world) {
  const Pool<OrganBody>& bodies = world.all<OrganBody>();
  for (std::size_t o = 0; o < bodies.size(); ++o) {
    const OrganModel& model = *bodies[o].model;
    OrganState state;
    state.positions = model.rest_positions;
    state.normals = model.rest_normals;
    state.displacements.assign(model.displacement_rows(), 0.0f);
    world.all<OrganState>().add(bodies.owner(o), std::move(state));
    world.all<OrganDraft>().add(bodies.owner(o), {});
  }
  start_linear_limits(world);
  return {};
}

/// The parts of what moves organs without forces -> FreeShape.
void shape_organs(World& world, const FrameContext&) {
  Pool<FreeShape>& shapes = world.all<FreeShape>();
  for (std::size_t o = 0; o < shapes.size(); ++o) {
    FreeShape& shape = shapes[o];
    shape.changed = shape.stale;
    if (!shape.stale) continue;
    shape.stale = false;
    shape.moves = false;
    std::fill(shape.places.begin(), shape.places.end(), 0.0f);
    for (const Feature& feature : world.model().features())
      if (feature.shape) shape.moves |= feature.shape(world, shapes.owner(o), shape.places);
    carry_displacements(world.find<OrganBody>(shapes.owner(o))->model->drawn, shape.places,
                        shape.vertices);
  }
}

/// Flags organs that are frozen, and those that are moved too far, every frame.
void check_world(World& world, const FrameContext& context) {
  const Pool<OrganState>& organs = world.all<OrganState>();
  for (std::size_t o = 0; o < organs.size(); ++o)
    if (organs[o].frozen && !is_gone(world, organs.owner(o))) context.report->raise(kOrganFrozen);
  if (measure_strains(world, context.time)) context.report->raise(kBeyondLinear);
}

void restored(World& world) {
  forget_device_shapes(world);
  forget_strains(world);
}

}  // namespace

Feature deformation_feature() {
  return {.name = "deformation",
          .prepare = prepare,
          .start = start,
          .states = {state_type<OrganState>({.contain = freeze_organ, .unchanged = all_stay}),
                     state_type<FreeShape>(), state_type<GreatestStrains>()},
          .stages = {{.name = "shape organs",
                      .reads = {"parts of free shapes"},
                      .writes = {"free shapes"},
                      .changes = {"free shapes"},
                      .needed = [](const World& world) { return world.has<FreeShape>(); },
                      .run = shape_organs},
                     {.name = "deform organs",
                      .reads = {"contact cells", "contact problem", "parts of free shapes",
                                "free shapes", "stiffness"},
                      .writes = {"forces", "shapes"},
                      .changes = {"organ contacts", "organ shapes", "tool forces", "links",
                                  "steps at finite strain", "jaws", "clips", "beds"},
                      .run = deform_organs},
                     {.name = "fetch surfaces",
                      .reads = {"shapes", "heat", "smoke"},
                      .writes = {"surfaces"},
                      .changes = {"organ shapes", "organ contacts", "tool forces"},
                      .needed = [](const World& world) { return world.has<GpuOrgans>(); },
                      .run = fetch_surfaces},
                     {.name = "check",
                      .reads = {"surfaces"},
                      .writes = {"flags"},
                      .changes = {"greatest strains"},
                      .run = check_world}},
          .flags = {kOrganFrozen, kContactNotConverged, kBeyondLinear, kTissueLost,
                    kTissueUnsettled, kGripSlipped},
          .replaced = take_shape_of_body,
          .restored = restored,
          .warnings = deformation_warnings};
}

}  // namespace viscera
