// Current through hooks and scissors, and the heat that it leaves in tissue.
#include "engine/features/cautery/cautery.h"

#include <algorithm>
#include <optional>

#include "engine/features/cautery/bipolar.h"
#include "engine/features/cautery/heat_setup.h"
#include "engine/features/contact/contact_cells.h"
#include "engine/features/contact/tissue_sheet.h"
#include "engine/features/parting/blades_in_tissue.h"
#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

/// A trace that goes on faster than this is two burns. Chosen [m/s].
constexpr double kTraceBreak = 0.3;
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

/// Where tissue that vapour has taken yields to metal that presses it: on what is left under it,
/// though the organ doesn't have another body yet. No deeper than the metal presses the surface in.
void sink_in(const World& world, Entity instrument, Entity organ, const SurfacePoint& point,
             ElectrodeContact& contact) {
  const OrganCut* cut = world.find<OrganCut>(organ);
  if (!cut || cut->gone.untouched()) return;
  const std::vector<CellRange>& ranges = world.find<OrganTouch>(organ)->ranges;
  const auto range = std::ranges::find_if(
      ranges, [&](const CellRange& one) { return one.instrument == instrument && !one.held; });
  if (range == ranges.end()) return;
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  const Vec3 place = corner_mean(world.find<OrganState>(organ)->positions, model.surface, point);
  const double pressed = (range->met.to_world(contact.point) - place)
                             .dot(range->met.direction_to_world(contact.outward));
  const double step = 0.5 * cut->gone.voxel();
  const Vec3 surface = contact.point;
  for (double depth = step; depth <= pressed && cut->gone.share(contact.point) < 0.5; depth += step)
    contact.point = surface - depth * contact.outward;
}

/// What of the tissue a tip presses [m2].
double touched_area(const World& world, Entity at, Entity instrument) {
  double area = 0.0;
  const OrganContact& organ = *world.find<OrganContact>(at);
  for (const CellRange& range : world.find<OrganTouch>(at)->ranges) {
    if (range.instrument != instrument || range.held) continue;
    for (std::size_t k = range.begin; k < range.end && k < organ.solution.forces.size(); ++k)
      if (organ.solution.forces[k].dot(organ.cells[k].direction) > 0.0) area += organ.cells[k].area;
  }
  return area;
}

/// Blades that cut an organ don't press it: current enters what of them is in it, by their two
/// faces, from step to step by the one and the other. Their place is that of the tissue beside
/// them, but for half the kerf; out of a kerf's void the nearest wall is.
std::optional<Meeting> meet_blades(const World& world, Entity instrument,
                                   const BladesInTissue& blades, std::uint64_t frame) {
  if (!world.find<OrganBurn>(blades.organ)) return {};
  Meeting meeting{blades.organ, {}};
  lay_on(*world.find<OrganBody>(blades.organ)->model,
         surface_left(world, blades.organ).closest(blades.middle).point, meeting.contact);
  if (blades.below) {
    const InstrumentState& state = *world.find<InstrumentState>(instrument);
    const Vec3 across = state.shaft_direction.cross(state.side_direction).normalized();
    meeting.contact.point = blades.middle;
    meeting.contact.outward =
        (frame % 2 == 0 ? 1.0 : -1.0) * pose_of(world, blades.organ).direction_to_local(across);
  }
  meeting.contact.area = blades.area;
  return meeting;
}

/// The tissue that the metal touches, or, with current, the nearest that a spark reaches.
std::optional<Meeting> meet(const World& world, Entity instrument, double gap) {
  const InstrumentContact& touch = *world.find<InstrumentContact>(instrument);
  if (touch.touching) {
    const OrganBurn* burn = world.find<OrganBurn>(touch.organ);
    if (!burn) return {};
    Meeting meeting{touch.organ, {}};
    const SurfacePoint at = surface_left(world, touch.organ).closest(touch.rest_point).point;
    lay_on(*world.find<OrganBody>(touch.organ)->model, at, meeting.contact);
    sink_in(world, instrument, touch.organ, at, meeting.contact);
    meeting.contact.area = touched_area(world, touch.organ, instrument);
    return meeting;
  }
  std::optional<Meeting> nearest;
  const InstrumentBody& body = *world.find<InstrumentBody>(instrument);
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  for (std::size_t b = 0; b < world.all<OrganBurn>().size() && gap > 0.0; ++b) {
    const Entity organ = world.all<OrganBurn>().owner(b);
    const OrganContact& contact = *world.find<OrganContact>(organ);
    if (world.find<OrganTouch>(organ)->bounds.exteriorDistance(state.tip) > body.extent + gap)
      continue;
    const OrganBody& tissue = *world.find<OrganBody>(organ);
    const auto foot = find_foot(tool_shape(body, state, pose_of(world, organ)), gap, *tissue.model,
                                *world.find<OrganState>(organ), *contact.surface);
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
  if (world.find<Sealer>(instrument)) return seal_tissue(world, instrument, trace, context);
  const InstrumentDescription& hook = world.find<InstrumentBody>(instrument)->description;
  const double power = world.find<InstrumentState>(instrument)->power;
  const InstrumentContact& touch = *world.find<InstrumentContact>(instrument);
  const auto blades = blades_in_tissue(world, instrument);
  const bool touches = blades || touch.touching;
  trace.current = {};
  if (power > 0.0 && touches && !world.find<OrganBurn>(blades ? blades->organ : touch.organ))
    context.report->raise(kNotHeated);
  const double gap = power > 0.0 ? spark_gap(waveform_of(mode_of(hook)).peak_voltage) : 0.0;
  const auto meeting = blades ? meet_blades(world, instrument, *blades, context.frame)
                              : meet(world, instrument, gap);
  if (!meeting) {
    trace.current.open = power > 0.0 && !touches;
    trace.organ = {};
    trace.tip.cool(context.dt);
    return;
  }
  const bool continues = !blades && trace.organ == meeting->organ &&
                         (trace.contact.point - meeting->contact.point).norm() <
                             kTraceBreak * world.model().steps().step();
  OrganBurn& burn = *world.find<OrganBurn>(meeting->organ);
  trace.current = trace.tip.energise(burn.heat, mode_of(hook), power,
                                     continues ? trace.contact : meeting->contact, meeting->contact,
                                     context.dt);
  trace.book.add(trace.current, context.dt);
  if (power > 0.0) burn.hook = instrument;
  trace.organ = meeting->organ;
  trace.contact = meeting->contact;
}

void heat_tissue(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.all<BurnTrace>().size(); ++i)
    give_current(world, world.all<BurnTrace>().owner(i), world.all<BurnTrace>()[i], context);
  for (OrganBurn& burn : world.all<OrganBurn>()) {
    burn.heat.step(context.dt);
    if (burn.heat.warm_bricks() == 0) continue;
    if (burn.heat.bricks().overflowed()) context.report->raise(kHeatFull);
    for (const Vapour& vapour : burn.heat.vapour()) burn.smoke += burn.heat.smoke(vapour);
    burn.greatest_hot = std::max(burn.greatest_hot, burn.heat.tissue_above(kHot));
  }
}

/// Heat spreads in what cuts have left.
void heat_what_is_left(World& world, Entity organ, const Continuation*) {
  if (OrganBurn* burn = world.find<OrganBurn>(organ))
    burn->heat.take_shapes(world.find<OrganLeft>(organ)->heated);
}

}  // namespace

const SurfaceTree& surface_left(const World& world, Entity organ) {
  const OrganLeft* left = world.find<OrganLeft>(organ);
  return left && left->tree ? *left->tree : *world.find<BurnableOrgan>(organ)->surface;
}

void GeneratorBook::add(const CurrentReport& current, double dt) {
  if (!(current.current > 0.0)) return;
  generated += current.generated() * dt;
  body += current.body_power * dt;
  metal += current.metal_power * dt;
  gas += current.gas_power * dt;
  sparks += current.spark_power * dt;
  least = time > 0.0 ? std::min(least, current.resistance) : current.resistance;
  greatest = std::max(greatest, current.resistance);
  time += dt;
  by_current += current.by_current * dt;
  by_voltage += current.by_voltage * dt;
  impedance += current.resistance * dt;
}

Feature cautery_feature() {
  return {.name = "cautery",
          .keys = cautery_keys(),
          .reach = burn_reach,
          .prepare = prepare_heat,
          .finish = warn_of_cold_organs,
          .start = start_heat,
          .states = {state_type<OrganBurn>(), state_type<BurnTrace>({Strays::Become::kAsBefore}),
                     state_type<Sealer>()},
          .stages = {{.name = "heat tissue",
                      .reads = {"forces", "shapes", "tool poses", "organ poses", "cuts",
                                "heat through beds"},
                      .reads_before = {"cuts by heat"},
                      .writes = {"heat"},
                      .changes = {"burns", "electrodes", "sealers"},
                      .needed = [](const World& world) { return world.has<BurnTrace>(); },
                      .run = heat_tissue}},
          .flags = {kHeatFull, kNotHeated},
          .replaced = heat_what_is_left,
          .restored = drop_unsound_seals,
          .report = cautery_report,
          .warnings = cautery_warnings,
          .skipped = cautery_skipped};
}

}  // namespace viscera
