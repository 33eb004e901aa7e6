#include <algorithm>
#include <cmath>

#include "engine/features/contact/contact.h"
#include "engine/features/contact/contact_cells.h"
#include "engine/features/contact/tissue_as_met.h"
#include "engine/features/jaws/hold.h"
#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

const Cling* cling_to(const OrganTouch& touch, Entity instrument) {
  for (const Cling& cling : touch.clings)
    if (cling.instrument == instrument) return &cling;
  return nullptr;
}

/// A closing jaw takes hold of the nearest tissue within its grip radius; of one organ where `only`
/// says so.
void try_grasp(World& world, const InstrumentBody& body, const InstrumentState& state,
               InstrumentContact& grip, std::optional<Entity> only = std::nullopt) {
  double nearest = body.description.grip_radius;
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const Entity organ = world.all<OrganBody>().owner(o);
    const OrganContact* contact = world.find<OrganContact>(organ);
    const OrganState& tissue = *world.find<OrganState>(organ);
    if (!contact || tissue.frozen || (only && !(*only == organ))) continue;
    const OrganBody& organ_body = world.all<OrganBody>()[o];
    const Pose& pose = pose_of(world, organ);
    const ToolShape tool = tool_shape(body, state, pose);
    const auto foot = find_foot(tool, nearest, *organ_body.model, tissue, *contact->surface);
    if (!foot) continue;
    std::vector<SurfacePoint> points;
    auto cells = grasp_cells(*foot, body.description.grip_radius, *organ_body.model,
                             *world.find<OrganTouch>(organ)->solver,
                             {*organ_body.model, tissue, *contact->surface}, points);
    if (cells.size() < 3) continue;
    nearest = foot->clearance;
    grip.grasp =
        Grasp{organ, state.tip, pose.position, Vec3::Zero(), std::move(cells), std::move(points)};
  }
}

/// Jaws that hold by their force take what lies between them: pinched from two sides, or, of
/// tissue with one side there, the patch. `again`: in place of what they slid over.
void take_between(World& world, const InstrumentBody& body, const InstrumentState& state,
                  const JawPose& from, bool again, Jaws& jaws, InstrumentContact& grip) {
  std::optional<Entity> only;
  if (again) only = grip.grasp->organ;
  const bool was_pinched = again && jaws.upper > 0;
  grip.grasp.reset();
  auto pinch = between_jaws(world, from.tip, from.normal, body.description.grip_radius, only);
  if (pinch)
    grip.grasp = Grasp{pinch->organ, from.tip,     pose_of(world, pinch->organ).position,
                       Vec3::Zero(), pinch->cells, pinch->points};
  else if (!was_pinched)
    try_grasp(world, body, state, grip, only);
  if (grip.grasp) begin_hold(from, pinch ? &*pinch : nullptr, again, jaws, *grip.grasp);
}

/// The frame of jaws that hold by their force.
void look_at_forceful(World& world, const FrameContext& context, Entity instrument,
                      const InstrumentBody& body, bool held, Jaws& jaws, InstrumentContact& grip) {
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  const JawPose before = pose_of_jaws(jaws);
  const bool again = grip.grasp && should_retake(jaws, body.description.grip_radius);
  move_jaws(*world.find<JawsBody>(instrument), state, context.time, grip.grasp.has_value(), jaws);
  if (!grip.jaw_closed || (held && !again)) return;
  take_between(world, body, state, again ? before : pose_of_jaws(jaws), again, jaws, grip);
  if (grip.grasp) return;
  if (again) ++jaws.lost;
  context.report->raise(again ? kTissueLeftJaws : kGripMissed);
}

void add_grasp_cells(World& world, OrganContact& contact, OrganTouch& touch, const Pose& pose,
                     Entity instrument, const Grasp& grasp, const InstrumentState& state) {
  CellRange range;
  range.instrument = instrument;
  range.held = true;
  range.begin = contact.cells.size();
  const Vec3 travel = pose.direction_to_local(jaw_travel(grasp, state, pose));
  const Jaws* jaws = world.find<Jaws>(instrument);
  for (std::size_t k = 0; k < grasp.cells.size(); ++k) {
    ContactCell cell = grasp.cells[k];
    if (jaws)
      cell.displacement = carried(*jaws, grasp, k, pose);
    else
      cell.displacement += travel;
    contact.cells.push_back(cell);
  }
  range.end = contact.cells.size();
  range.points = grasp.points;
  touch.ranges.push_back(range);
}

void look_at_jaws(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.all<InstrumentBody>().size(); ++i) {
    const Entity instrument = world.all<InstrumentBody>().owner(i);
    const InstrumentBody& body = world.all<InstrumentBody>()[i];
    const InstrumentState& state = *world.find<InstrumentState>(instrument);
    InstrumentContact& grip = *world.find<InstrumentContact>(instrument);
    grip.force = Vec3::Zero();
    grip.touching = false;
    grip.strongest = 0.0;
    if (body.description.kind != InstrumentKind::kGrasper) continue;
    const bool held = grip.jaw_closed;
    grip.jaw_closed = jaw_closed(held, state.jaw);
    if (!grip.jaw_closed) grip.grasp.reset();
    if (Jaws* jaws = world.find<Jaws>(instrument)) {
      look_at_forceful(world, context, instrument, body, held, *jaws, grip);
      continue;
    }
    if (!grip.jaw_closed || held) continue;
    try_grasp(world, body, state, grip);
    if (!grip.grasp) context.report->raise(kGripMissed);
  }
}

/// The cells of one tool that presses this organ; false when it doesn't.
bool lay_pressed_cells(World& world, Entity organ, OrganContact& contact, std::size_t which,
                       CellRange& range) {
  const OrganTouch& touch = *world.find<OrganTouch>(organ);
  const OrganState& tissue = *world.find<OrganState>(organ);
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  const InstrumentBody& body = world.all<InstrumentBody>()[which];
  range.instrument = world.all<InstrumentBody>().owner(which);
  const ToolShape tool =
      tool_shape(body, *world.find<InstrumentState>(range.instrument), pose_of(world, organ));
  take_motion_as_met(world, organ, tool.tip, range);
  const TissueSheet drawn(model, tissue, *contact.surface), met(model, *contact.rest, range.met);
  const auto foot = find_foot_as_met(tool, kContactMargin, model, drawn, met);
  if (!foot) return false;
  Rubbing rubbing{body.description.friction, cling_to(touch, range.instrument), Vec3::Zero()};
  if (rubbing.cling) rubbing.undrawn = undrawn_drag(*rubbing.cling, tissue, model);
  return press_cells(tool, *foot, rubbing, model, drawn, met, contact.cells, range);
}

/// The cells that tools press or hold on one organ.
void lay_cells(World& world, Entity organ, OrganContact& contact, const FrameContext& context) {
  OrganTouch& touch = *world.find<OrganTouch>(organ);
  contact.cells.clear();
  contact.held_points.clear();
  std::vector<CellRange> ranges;
  const OrganState& tissue = *world.find<OrganState>(organ);
  if (!tissue.frozen) {
    const Pool<InstrumentBody>& bodies = world.all<InstrumentBody>();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Entity instrument = bodies.owner(i);
      const InstrumentState& state = *world.find<InstrumentState>(instrument);
      // The cheap test that an idle organ costs: tip against bounding box.
      const double margin = bodies[i].extent + kContactMargin;
      if (touch.bounds.exteriorDistance(state.tip) > margin) continue;
      const InstrumentContact& grip = *world.find<InstrumentContact>(instrument);
      if (grip.grasp && grip.grasp->organ == organ) continue;
      if (cuts(world, instrument, organ)) continue;
      // Its clips touch, not its own bars; a bag's film presses nothing.
      if (bodies[i].description.kind == InstrumentKind::kClipApplier ||
          bodies[i].description.kind == InstrumentKind::kBag)
        continue;
      // What enters between open jaws meets no tip.
      const Jaws* jaws = world.find<Jaws>(instrument);
      if (jaws && !grip.jaw_closed &&
          lies_between(world, organ, jaws->tip, jaws->normal, bodies[i].description.grip_radius))
        continue;
      CellRange range;
      if (!lay_pressed_cells(world, organ, contact, i, range)) continue;
      if (!touch.solver->touchable(range.rest_centre)) {
        contact.cells.resize(range.begin);
        context.report->raise(kOutOfReach);
        continue;
      }
      ranges.push_back(range);
    }
  }
  touch.ranges = std::move(ranges);
  if (tissue.frozen) return;
  for (const Entity instrument : world.model().instruments()) {
    const InstrumentContact& grip = *world.find<InstrumentContact>(instrument);
    if (grip.grasp && grip.grasp->organ == organ)
      add_grasp_cells(world, contact, touch, pose_of(world, organ), instrument, *grip.grasp,
                      *world.find<InstrumentState>(instrument));
  }
}

}  // namespace

void find_contacts(World& world, const FrameContext& context) {
  look_at_jaws(world, context);
  Pool<OrganContact>& contacts = world.all<OrganContact>();
  for (std::size_t o = 0; o < contacts.size(); ++o)
    lay_cells(world, contacts.owner(o), contacts[o], context);
}

void let_cells_move(World& world) {
  Pool<FreeShape>& shapes = world.all<FreeShape>();
  for (std::size_t o = 0; o < shapes.size(); ++o) {
    const Entity organ = shapes.owner(o);
    OrganContact* contact = world.find<OrganContact>(organ);
    if (!contact || contact->cells.empty()) continue;
    const TriangleSurface& surface = world.find<OrganBody>(organ)->model->surface;
    std::vector<SurfacePoint> points;
    for (const CellRange& range : world.find<OrganTouch>(organ)->ranges)
      points.insert(points.end(), range.points.begin(), range.points.end());
    points.insert(points.end(), contact->held_points.begin(), contact->held_points.end());
    let_move(shapes[o], surface, points, contact->cells);
  }
}

}  // namespace viscera
