// Current through hooks, and the heat that it leaves in tissue.
#include <algorithm>
#include <optional>

#include "engine/systems/contact_cells.h"
#include "engine/systems/systems.h"
#include "engine/systems/tissue_changes.h"

namespace viscera {
namespace {

/// A trace that jumps further than this within a frame is two burns [m].
constexpr double kTraceBreak = 5e-3;
/// Tissue that is counted as hot [K].
constexpr double kHot = kZeroCelsius + 60.0;

/// Where a hook's metal meets an organ, or is near enough for a spark.
struct Meeting {
  Entity organ;
  ElectrodeContact contact;  ///< rest frame
};

/// Fills in place and direction from a point of the drawn surface.
void lay_on(const OrganModel& model, const SurfacePoint& point, ElectrodeContact& contact) {
  const auto& corners = model.surface.triangles[static_cast<std::size_t>(point.triangle)];
  Vec3 place = Vec3::Zero(), normal = Vec3::Zero();
  for (std::size_t c = 0; c < 3; ++c) {
    const double weight = point.weights[static_cast<int>(c)];
    const auto corner = static_cast<std::size_t>(corners[c]);
    place += weight * model.surface.vertices[corner];
    normal += weight * model.rest_normals[corner].cast<double>();
  }
  contact.point = place;
  contact.outward = normal.normalized();
}

/// What of the tissue a tip presses [m2].
double touched_area(const OrganContact& organ, Entity instrument) {
  double area = 0.0;
  for (const CellRange& range : organ.ranges) {
    if (range.instrument != instrument || range.held) continue;
    for (std::size_t k = range.begin; k < range.end && k < organ.solution.forces.size(); ++k)
      if (organ.solution.forces[k].dot(organ.cells[k].direction) > 0.0) area += organ.cells[k].area;
  }
  return area;
}

/// The tissue that the metal touches, or, with current, the nearest that a spark reaches.
std::optional<Meeting> meet(const World& world, Entity instrument, double gap) {
  const InstrumentContact& touch = *world.instrument_contacts.find(instrument);
  if (touch.touching) {
    const OrganBurn* burn = world.organ_burns.find(touch.organ);
    if (!burn) return {};
    Meeting meeting{touch.organ, {}};
    lay_on(*world.organ_bodies.find(touch.organ)->model,
           burn->surface->closest(touch.rest_point).point, meeting.contact);
    meeting.contact.area = touched_area(*world.organ_contacts.find(touch.organ), instrument);
    return meeting;
  }
  std::optional<Meeting> nearest;
  const InstrumentBody& body = *world.instrument_bodies.find(instrument);
  const InstrumentState& state = *world.instrument_states.find(instrument);
  for (std::size_t b = 0; b < world.organ_burns.size() && gap > 0.0; ++b) {
    const Entity organ = world.organ_burns.owner(b);
    const OrganContact& contact = *world.organ_contacts.find(organ);
    if (contact.bounds.exteriorDistance(state.tip) > body.extent + gap) continue;
    const OrganBody& tissue = *world.organ_bodies.find(organ);
    const auto foot = find_foot(tool_shape(body, state, tissue.pose), gap, *tissue.model,
                                *world.organ_states.find(organ), *contact.surface);
    if (!foot) continue;
    const auto hit = contact.surface->closest(foot->position, 1e-3);
    if (!hit) continue;
    gap = foot->clearance;
    nearest.emplace(Meeting{organ, {}});
    lay_on(*tissue.model, hit->point, nearest->contact);
    nearest->contact.depth = -std::max(0.0, foot->clearance);
  }
  return nearest;
}

void give_current(World& world, Entity instrument, BurnTrace& trace, const FrameContext& context) {
  const InstrumentDescription& hook = world.instrument_bodies.find(instrument)->description;
  const double power = world.instrument_states.find(instrument)->power;
  const InstrumentContact& touch = *world.instrument_contacts.find(instrument);
  trace.current = {};
  if (power > 0.0 && touch.touching && !world.organ_burns.find(touch.organ))
    context.report->raise(FrameFlag::kNotHeated);
  const double gap = power > 0.0 ? spark_gap(waveform_of(hook.mode).peak_voltage) : 0.0;
  const auto meeting = meet(world, instrument, gap);
  if (!meeting) {
    trace.current.open = power > 0.0 && !touch.touching;
    trace.organ = {};
    trace.tip.cool(context.dt);
    return;
  }
  const bool continues = trace.organ == meeting->organ &&
                         (trace.contact.point - meeting->contact.point).norm() < kTraceBreak;
  OrganBurn& burn = *world.organ_burns.find(meeting->organ);
  trace.current =
      trace.tip.energise(burn.heat, hook.mode, power, continues ? trace.contact : meeting->contact,
                         meeting->contact, context.dt);
  trace.generated +=
      context.dt * (trace.current.power + trace.current.far_power + trace.current.spark_power);
  if (power > 0.0) burn.hook = instrument;
  trace.organ = meeting->organ;
  trace.contact = meeting->contact;
}

}  // namespace

void heat_tissue(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.burn_traces.size(); ++i)
    give_current(world, world.burn_traces.owner(i), world.burn_traces[i], context);
  for (OrganBurn& burn : world.organ_burns) {
    burn.heat.step(context.dt);
    if (burn.heat.warm_bricks() == 0) continue;
    if (burn.heat.bricks().overflowed()) context.report->raise(FrameFlag::kHeatFull);
    for (const Vapour& vapour : burn.heat.vapour()) burn.smoke += burn.heat.smoke(vapour);
    burn.greatest_hot = std::max(burn.greatest_hot, burn.heat.tissue_above(kHot));
  }
  follow_changes(world, context.frame);
}

void check_world(World& world, const FrameContext& context) {
  for (const OrganState& state : world.organ_states)
    if (state.frozen) context.report->raise(FrameFlag::kOrganFrozen);
}

}  // namespace viscera
