#include "engine/features/cautery/bipolar.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/jaws/hold.h"
#include "kernels/heat/jaw_current.h"

namespace viscera {
namespace {

/// The generator ends once the impedance is so many times its least of the cycle. Chosen: those of
/// vessel sealers watch its rise and plateau.
constexpr double kRises = 4.0;
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
  if (!grasp || !jaws || jaws->upper == 0 || !(jaws->thickness > 0.0) ||
      !(jaws->gap_then > jaws->closed))
    return {};
  Held held{grasp->organ, {}, jaws->gap_then - jaws->closed, jaws->thickness};
  const std::size_t pairs = std::min<std::size_t>(jaws->upper, grasp->cells.size() - jaws->upper);
  for (std::size_t k = 0; k < pairs; ++k) {
    const ContactCell &upper = grasp->cells[k], &lower = grasp->cells[jaws->upper + k];
    held.columns.push_back({upper.position, lower.position, 0.5 * (upper.area + lower.area)});
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

/// Warmth between the jaws' metal and the tissue on both sides, as discs of their area.
void trade_heat(const Held& held, const Seal& seal, Bioheat& heat, ElectrodeTip& metal, double dt) {
  double area = 0.0;
  for (const JawColumn& column : held.columns) area += column.area;
  for (const double side : {1.0, -1.0}) {
    ElectrodeContact contact;
    contact.outward = side * seal.axes.col(1);
    contact.point = seal.middle + side * 0.5 * seal.half.y() * seal.axes.col(1);
    Vec3 sum = Vec3::Zero();
    for (const JawColumn& column : held.columns)
      sum += column.area * (side > 0.0 ? column.upper : column.lower);
    contact.point = sum / area;
    metal.trade_heat(heat, contact, std::sqrt(area / std::numbers::pi), dt);
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

void seal_tissue(World& world, Entity instrument, BurnTrace& trace, const FrameContext& context) {
  Sealer& sealer = *world.find<Sealer>(instrument);
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  const auto held = held_between(world, instrument);
  OrganBurn* burn = held ? world.find<OrganBurn>(held->organ) : nullptr;
  trace.current = {};
  if (!burn) {
    end_cycle(sealer);
    sealer.cooling = false;
    trace.current.open = state.power > 0.0;
    if (state.power > 0.0 && held) context.report->raise(kNotHeated);
    trace.tip.cool(context.dt);
    return;
  }
  Seal seal;
  const Pose& pose = pose_of(world, held->organ);
  measure(*held, pose.direction_to_local(state.shaft_direction), seal);
  JawCurrent current(burn->heat, held->columns, held->gap);
  if (!(state.power > 0.0)) {
    end_cycle(sealer);
    // Warm tissue goes on coagulating between the jaws.
    if (sealer.cooling) sealer.seals.back().coagulated = current.coagulated();
  } else {
    if (!sealer.on || !(sealer.now.organ == held->organ)) {
      end_cycle(sealer);
      sealer.on = true;
      sealer.now = seal;
      sealer.now.organ = held->organ;
      sealer.now.begun = context.time - context.dt;
      sealer.now.least = current.resistance();
    }
    sealer.cooling = false;
    Seal& now = sealer.now;
    now.coagulated = current.coagulated();
    if (!sealer.over) {
      now.least = std::min(now.least, current.resistance());
      now.last = current.resistance();
      now.squeezed = held->gap / held->thickness;
      now.middle = seal.middle;
      now.axes = seal.axes;
      now.half = seal.half;
      now.ended = context.time;
      sealer.over = now.dried = now.last > kRises * now.least;
    }
    if (!sealer.over) {
      trace.current = current.pass(burn->heat, BipolarGenerator{}, state.power, context.dt);
      trace.book.add(trace.current, context.dt);
      burn->hook = instrument;
    }
  }
  trade_heat(*held, seal, burn->heat, trace.tip, context.dt);
  trace.tip.cool(context.dt);
}

}  // namespace viscera
