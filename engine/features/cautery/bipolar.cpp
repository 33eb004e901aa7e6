#include "engine/features/cautery/bipolar.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/jaws/hold.h"
#include "kernels/heat/jaw_current.h"

namespace viscera {
namespace {

/// The generator ends once the impedance is so many times its least of the cycle, at the same gap.
/// Chosen: those of vessel sealers watch its rise and plateau.
constexpr double kRises = 1.25;
/// Share of a seal that has coagulated, for it to hold. Chosen.
constexpr double kFused = 0.9;

/// What jaws hold of an organ from two sides.
struct Held {
  Entity organ;
  std::vector<JawColumn> columns;
  double gap = 0.0;        ///< between the jaws [m]
  double thickness = 0.0;  ///< of the tissue at rest [m]
};

std::optional<Held> held_between(const World& world, Entity instrument) {
  const std::optional<Grasp>& grasp = world.find<InstrumentContact>(instrument)->grasp;
  const Jaws* jaws = world.find<Jaws>(instrument);
  if (!grasp || !jaws || jaws->upper == 0 || jaws->upper >= grasp->cells.size() ||
      !(jaws->thickness > 0.0) || !(jaws->gap_then > jaws->closed))
    return {};
  Held held{grasp->organ, {}, jaws->gap_then - jaws->closed, jaws->thickness};
  // Cells have the areas that they had as they were taken, squeezed as the tissue was then.
  const double wider = std::clamp(jaws->gap_then / jaws->thickness, kLeastGap, 1.0);
  const std::size_t pairs = std::min<std::size_t>(jaws->upper, grasp->cells.size() - jaws->upper);
  for (std::size_t k = 0; k < pairs; ++k) {
    const ContactCell &upper = grasp->cells[k], &lower = grasp->cells[jaws->upper + k];
    held.columns.push_back(
        {upper.position, lower.position, 0.5 * wider * (upper.area + lower.area)});
  }
  return held;
}

/// What lies between, for its place and size.
void measure(const Held& held, const Vec3& shaft, Seal& seal) {
  Vec3 up = Vec3::Zero();
  double area = 0.0;
  seal.middle = Vec3::Zero();
  for (const JawColumn& column : held.columns) {
    seal.middle += 0.5 * column.area * (column.upper + column.lower);
    up += column.area * (column.upper - column.lower);
    area += column.area;
  }
  seal.middle /= area;
  const Vec3 normal = up.normalized(), along = (shaft - shaft.dot(normal) * normal).normalized();
  seal.axes << along, normal, along.cross(normal);
  seal.half = Vec3::Zero();
  for (const JawColumn& column : held.columns)
    for (const Vec3& place : {column.upper, column.lower})
      seal.half = seal.half.cwiseMax((seal.axes.transpose() * (place - seal.middle)).cwiseAbs() +
                                     0.5 * std::sqrt(column.area) * Vec3(1.0, 0.0, 1.0));
}

/// Warmth between the jaws' metal and the tissue under each cell.
void trade_heat(const Held& held, Bioheat& heat, ElectrodeTip& metal, double dt) {
  for (const JawColumn& column : held.columns)
    for (const double side : {1.0, -1.0}) {
      ElectrodeContact contact;
      contact.outward = side * (column.upper - column.lower).normalized();
      contact.point = side > 0.0 ? column.upper : column.lower;
      metal.trade_heat(heat, contact, std::sqrt(column.area / std::numbers::pi), dt);
    }
}

void end_cycle(Sealer& sealer) {
  if (sealer.on && sealer.now.ended > sealer.now.begun) {
    sealer.seals.push_back(sealer.now);
    sealer.cooling = true;
  }
  sealer.on = sealer.over = false;
}

}  // namespace

bool Seal::fused() const {
  return coagulated >= kFused;
}

bool Seal::holds_within(const Vec3& place) const {
  return ((axes.transpose() * (place - middle)).cwiseAbs() - half).maxCoeff() <= 0.0;
}

void drop_unsound_seals(World& world) {
  for (Sealer& sealer : world.all<Sealer>()) {
    std::erase_if(sealer.seals,
                  [&](const Seal& seal) { return !world.find<OrganBurn>(seal.organ); });
    sealer.on = sealer.on && world.find<OrganBurn>(sealer.now.organ);
    sealer.cooling = sealer.cooling && !sealer.seals.empty();
  }
}

void seal_tissue(World& world, Entity instrument, BurnTrace& trace, const FrameContext& context) {
  Sealer& sealer = *world.find<Sealer>(instrument);
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  const auto held = held_between(world, instrument);
  OrganBurn* burn = held ? world.find<OrganBurn>(held->organ) : nullptr;
  trace.current = {};
  trace.organ = {};
  if (!burn) {
    end_cycle(sealer);
    sealer.cooling = false;
    trace.current.open = state.power > 0.0 && !held;
    if (state.power > 0.0 && held) context.report->raise(kNotHeated);
    trace.tip.cool(context.dt);
    return;
  }
  const std::uint64_t retaken = world.find<Jaws>(instrument)->retaken;
  if ((sealer.on || sealer.cooling) &&
      (sealer.retaken != retaken || !(sealer.now.organ == held->organ))) {
    end_cycle(sealer);
    sealer.cooling = false;
  }
  if (!(state.power > 0.0)) end_cycle(sealer);
  if (state.power > 0.0 && !sealer.over) {
    JawCurrent current(burn->heat, held->columns, held->gap);
    const double resistance = current.resistance();
    const double by_gap = resistance / (held->gap * held->gap);
    trace.current.open = !std::isfinite(resistance);
    if (!trace.current.open && !sealer.on) {
      sealer.on = true;
      sealer.cooling = false;
      sealer.retaken = retaken;
      sealer.least_by_gap = by_gap;
      sealer.now = {};
      sealer.now.organ = held->organ;
      sealer.now.begun = context.time - context.dt;
      sealer.now.least = resistance;
      measure(*held, pose_of(world, held->organ).direction_to_local(state.shaft_direction),
              sealer.now);
    }
    if (!trace.current.open) {
      Seal& now = sealer.now;
      now.least = std::min(now.least, resistance);
      now.last = resistance;
      now.squeezed = held->gap / held->thickness;
      now.ended = context.time;
      sealer.least_by_gap = std::min(sealer.least_by_gap, by_gap);
      sealer.over = now.dried = by_gap > kRises * sealer.least_by_gap;
    }
    if (sealer.on && !sealer.over && !trace.current.open) {
      trace.current = current.pass(burn->heat, BipolarGenerator{}, state.power, context.dt);
      trace.book.add(trace.current, context.dt);
      burn->hook = instrument;
    }
  }
  if (sealer.on || sealer.cooling) {
    // Warm tissue goes on coagulating between the jaws, and nothing undoes that.
    Seal& seal = sealer.on ? sealer.now : sealer.seals.back();
    seal.coagulated = std::max(seal.coagulated, coagulated_between(burn->heat, held->columns));
    trace.organ = held->organ;
    trace.contact.point = seal.middle;
    trace.contact.outward = seal.axes.col(1);
  }
  trade_heat(*held, burn->heat, trace.tip, context.dt);
  trace.tip.cool(context.dt);
}

}  // namespace viscera
