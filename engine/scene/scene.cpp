#include "engine/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {

bool Region::contains(const Vec3& x) const {
  switch (shape) {
    case Shape::kHalfSpace:
      return (x - a).dot(b) <= 0.0;
    case Shape::kSphere:
      return (x - a).squaredNorm() <= radius * radius;
    case Shape::kBox:
      return (x.array() >= a.array()).all() && (x.array() <= b.array()).all();
  }
  return false;
}

Region Region::grown(double margin) const {
  Region larger = *this;
  switch (shape) {
    case Shape::kHalfSpace:
      larger.a += margin * b;
      break;
    case Shape::kSphere:
      larger.radius += margin;
      break;
    case Shape::kBox:
      larger.a.array() -= margin;
      larger.b.array() += margin;
      break;
  }
  return larger;
}

Vec3 MotionDescription::displacement(double time) const {
  const double s = std::sin(std::numbers::pi * time / period + 0.5 * phase);
  return amplitude * (s * s) * (s * s) * direction;
}

Vec3 MotionDescription::velocity(double time) const {
  const double angle = std::numbers::pi * time / period + 0.5 * phase;
  const double s = std::sin(angle);
  return 4.0 * std::numbers::pi / period * amplitude * (s * s * s) * std::cos(angle) * direction;
}

Pose OrganDescription::pose_at(double time) const {
  Pose now = pose;
  if (motion) now.position += motion->displacement(time);
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
