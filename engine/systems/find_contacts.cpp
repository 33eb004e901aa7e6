#include <algorithm>
#include <cmath>

#include "engine/systems/contact_cells.h"
#include "engine/systems/links.h"
#include "engine/systems/systems.h"

namespace viscera {
namespace {

/// The force that pressed the tissue, without the drag of friction.
double last_force_on(const OrganContact& contact, Entity instrument, double friction) {
  for (const CellRange& range : contact.ranges) {
    if (range.instrument != instrument || range.held) continue;
    return friction > 0.0 ? std::max(0.0, -range.force.dot(range.outward)) : range.force.norm();
  }
  return 0.0;
}

const Cling* cling_to(const OrganContact& contact, Entity instrument) {
  for (const Cling& cling : contact.clings)
    if (cling.instrument == instrument) return &cling;
  return nullptr;
}

/// A closing jaw takes hold of the nearest tissue within its grip radius.
void try_grasp(World& world, const InstrumentBody& body, const InstrumentState& state,
               InstrumentContact& grip) {
  double nearest = body.description.grip_radius;
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    const Entity organ = world.organ_bodies.owner(o);
    const OrganContact* contact = world.organ_contacts.find(organ);
    const OrganState& tissue = *world.organ_states.find(organ);
    if (!contact || tissue.frozen) continue;
    const OrganBody& organ_body = world.organ_bodies[o];
    const ToolShape tool = tool_shape(body, state, organ_body.pose);
    const auto foot = find_foot(tool, nearest, *organ_body.model, tissue, *contact->surface);
    if (!foot) continue;
    std::vector<SurfacePoint> points;
    auto cells = grasp_cells(*foot, body.description.grip_radius, *organ_body.model,
                             *contact->surface, points);
    if (cells.size() < 3) continue;
    nearest = foot->clearance;
    grip.grasp = Grasp{organ,        state.tip,        organ_body.pose.position,
                       Vec3::Zero(), std::move(cells), std::move(points)};
  }
}

void add_grasp_cells(OrganContact& contact, const OrganBody& body, Entity instrument,
                     const Grasp& grasp, const InstrumentState& state) {
  CellRange range;
  range.instrument = instrument;
  range.held = true;
  range.begin = contact.cells.size();
  const Vec3 carried = body.pose.direction_to_local(jaw_travel(grasp, state, body.pose));
  for (ContactCell cell : grasp.cells) {
    cell.displacement += carried;
    contact.cells.push_back(cell);
  }
  range.end = contact.cells.size();
  range.points = grasp.points;
  contact.ranges.push_back(range);
}

/// Contact sees the tissue where gravity has moved it.
void let_cells_sag(World& world) {
  for (std::size_t o = 0; o < world.organ_sags.size(); ++o) {
    const Entity organ = world.organ_sags.owner(o);
    OrganContact* contact = world.organ_contacts.find(organ);
    if (!contact || contact->cells.empty()) continue;
    const TriangleSurface& surface = world.organ_bodies.find(organ)->model->surface;
    std::vector<SurfacePoint> points;
    for (const CellRange& range : contact->ranges)
      points.insert(points.end(), range.points.begin(), range.points.end());
    if (is_link_loaded(world, organ)) {
      const OrganTies& ties = *world.organ_ties.find(organ);
      points.insert(points.end(), ties.points.begin(), ties.points.end());
    }
    let_sag(world.organ_sags[o], surface, points, contact->cells);
  }
}

}  // namespace

void find_contacts(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i) {
    const Entity instrument = world.instrument_bodies.owner(i);
    const InstrumentBody& body = world.instrument_bodies[i];
    const InstrumentState& state = *world.instrument_states.find(instrument);
    InstrumentContact& grip = *world.instrument_contacts.find(instrument);
    grip.force = Vec3::Zero();
    grip.touching = false;
    grip.strongest = 0.0;
    if (body.description.kind != InstrumentKind::kGrasper) continue;
    const bool held = grip.jaw_closed;
    grip.jaw_closed = jaw_closed(held, state.jaw);
    if (!grip.jaw_closed) grip.grasp.reset();
    if (!grip.jaw_closed || held) continue;
    try_grasp(world, body, state, grip);
    if (!grip.grasp) context.report->raise(FrameFlag::kGripMissed);
  }

  for (std::size_t o = 0; o < world.organ_contacts.size(); ++o) {
    const Entity organ = world.organ_contacts.owner(o);
    OrganContact& contact = world.organ_contacts[o];
    const OrganBody& body = *world.organ_bodies.find(organ);
    const OrganState& tissue = *world.organ_states.find(organ);

    contact.cells.clear();
    std::vector<CellRange> ranges;
    for (std::size_t i = 0; i < world.instrument_bodies.size() && !tissue.frozen; ++i) {
      const Entity instrument = world.instrument_bodies.owner(i);
      const InstrumentState& state = *world.instrument_states.find(instrument);
      const InstrumentContact& grip = *world.instrument_contacts.find(instrument);
      if (grip.grasp && grip.grasp->organ == organ) continue;
      // The cheap test that an idle organ costs: tip against bounding box.
      const double margin = world.instrument_bodies[i].extent + kContactMargin;
      if (contact.bounds.exteriorDistance(state.tip) > margin) continue;
      const ToolShape tool = tool_shape(world.instrument_bodies[i], state, body.pose);
      const auto foot = find_foot(tool, kContactMargin, *body.model, tissue, *contact.surface);
      if (!foot) continue;
      CellRange range;
      range.instrument = instrument;
      Rubbing rubbing{world.instrument_bodies[i].description.friction,
                      cling_to(contact, instrument), Vec3::Zero()};
      if (rubbing.cling) rubbing.undrawn = undrawn_drag(*rubbing.cling, tissue, *body.model);
      if (!press_cells(tool, *foot, last_force_on(contact, instrument, rubbing.friction), rubbing,
                       *body.model, *contact.surface, contact.cells, range))
        continue;
      if (!is_touchable(body.model->touchable, range.rest_centre)) {
        contact.cells.resize(range.begin);
        context.report->raise(FrameFlag::kOutOfReach);
        continue;
      }
      ranges.push_back(range);
    }
    contact.ranges = std::move(ranges);
    for (std::size_t i = 0; i < world.instrument_bodies.size() && !tissue.frozen; ++i) {
      const Entity instrument = world.instrument_bodies.owner(i);
      const InstrumentContact& grip = *world.instrument_contacts.find(instrument);
      if (grip.grasp && grip.grasp->organ == organ)
        add_grasp_cells(contact, body, instrument, *grip.grasp,
                        *world.instrument_states.find(instrument));
    }
  }
  add_link_cells(world);
  let_cells_sag(world);
}

}  // namespace viscera
