#include "engine/features/local/hive_settings.h"

#include <algorithm>

#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/simulation/tool_shape.h"

namespace viscera {
namespace {

/// The influence region of a hive whose scene doesn't say it: so many radii of the tool, and so
/// many spacings of the nodes where a coupled field must be smooth on them.
constexpr double kRadiiOfTool = 4.0, kSpacings = 3.0;
constexpr int kNodes = 120;
/// Of the disc that stands for a ball at finite strains in layered tissue, over the ball's radius.
/// Chosen: a ball is pressed some half of its width.
constexpr double kPressed = 0.5;
/// Of a tool's cells: 37, as the frame's contact lays them. 19 make a ball feel 5 to 9 % stiffer
/// than many do, up to half a radius deep; 37 lie within 3 %.
constexpr int kRings = 3;

HivePeriphery periphery_of(const HiveDescription& hive, bool global) {
  if (!hive.periphery) return global ? HivePeriphery::kCoupled : HivePeriphery::kBoussinesq;
  switch (*hive.periphery) {
    case HiveDescription::Periphery::kCoupled:
      return HivePeriphery::kCoupled;
    case HiveDescription::Periphery::kBoussinesq:
      return HivePeriphery::kBoussinesq;
    case HiveDescription::Periphery::kFixed:
      return HivePeriphery::kFixed;
  }
  return HivePeriphery::kBoussinesq;
}

}  // namespace

Result<void> check_round(const TipDescription& tip) {
  if (tip.shape == TipDescription::Shape::kSphere || tip.shape == TipDescription::Shape::kPoint)
    return {};
  return failure("tip/shape: found a capsule or mesh where hives answer, expected sphere or point");
}

Result<HiveTissueSettings> hive_settings(const InstrumentDescription& instrument,
                                         const OrganBody& organ, HiveBuilding building) {
  const TipDescription& tip = instrument.tip;
  if (auto round = check_round(tip); !round) return std::unexpected(round.error());
  const HapticDescription* haptic = haptic_of(instrument);
  const HiveDescription wanted = haptic ? haptic->hive : HiveDescription();
  const bool global = organ.model->touchable_anywhere();
  HiveTissueSettings settings;
  settings.tool_radius = tip.shape == TipDescription::Shape::kPoint ? kPointTipRadius : tip.radius;
  settings.building = building;
  HiveSettings& hive = settings.hive;
  hive.material = organ.tissue.elastic;
  hive.periphery = periphery_of(wanted, global);
  hive.formulation = wanted.paper ? HiveFormulation::kPaper : HiveFormulation::kSubtracted;
  const double nodes_apart = global ? organ.model->finest_spacing : 0.0;
  hive.radius = wanted.radius > 0.0
                    ? wanted.radius
                    : std::max(kRadiiOfTool * settings.tool_radius, kSpacings * nodes_apart);
  hive.nodes = wanted.nodes > 0 ? wanted.nodes : kNodes;
  hive.pressed = kPressed * settings.tool_radius;
  settings.model = organ.tissue.model;
  settings.prony = organ.tissue.prony;
  settings.rings = kRings;
  return settings;
}

HiveSettings contact_hive(std::span<const InstrumentDescription> instruments,
                          const OrganBody& organ) {
  HiveSettings hive;
  hive.material = organ.tissue.elastic;
  hive.nodes = kNodes;
  double widest = kPointTipRadius;
  for (const InstrumentDescription& instrument : instruments) {
    widest = std::max(widest, instrument.tip.radius + 0.5 * instrument.tip.length);
    if (instrument.kind == InstrumentKind::kGrasper)
      widest = std::max(widest, instrument.grip_radius);
  }
  hive.radius = kRadiiOfTool * widest;
  return hive;
}

}  // namespace viscera
