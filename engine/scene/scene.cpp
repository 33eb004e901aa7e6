#include "engine/scene/scene.h"

#include <algorithm>

namespace viscera {

Pose OrganDescription::pose_at(double time) const {
  Pose now = pose;
  if (const auto* motion = extras.find<FrameMotion>()) now.position += motion->displacement(time);
  return now;
}

double GasDescription::density() const {
  constexpr double kAtmosphere = 101325.0;      // [Pa]
  constexpr double kMolarMass = 0.04401;        // of CO2 [kg/mol]
  constexpr double kGasConstant = 8.314462618;  // [J/mol/K]
  return (kAtmosphere + pressure) * kMolarMass / (kGasConstant * temperature);
}

bool GravityDescription::changes() const {
  return acceleration > 0.0 && (rest_direction != -Vec3::UnitZ() ||
                                std::any_of(table.begin(), table.end(), [](const TableKey& key) {
                                  return key.head_up != 0.0 || key.left_down != 0.0;
                                }));
}

bool carries_current(const InstrumentDescription& tool) {
  return (tool.kind == InstrumentKind::kHook || tool.kind == InstrumentKind::kSpatula) &&
         std::any_of(tool.path.begin(), tool.path.end(),
                     [](const InstrumentKey& key) { return key.power > 0.0; });
}

}  // namespace viscera
