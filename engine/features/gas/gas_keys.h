// What a scene says of the gas that holds the cavity open.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/interval.h"
#include "engine/scene/scene.h"
#include "kernels/smoke/cavity.h"
#include "kernels/smoke/gas_mixture.h"

namespace viscera {

inline constexpr double kPascalPerMillimetreOfMercury = 133.322387415;

struct InletDescription {
  Vec3 position = Vec3::Zero();     ///< [m]
  Vec3 direction = -Vec3::UnitZ();  ///< unit
  double radius = 3e-3;             ///< [m]
  double limit = 0.0;               ///< the most that comes in [m3/s]
  Interval when;
};

/// A hole.
struct LeakDescription {
  Vec3 position = Vec3::Zero();  ///< [m]
  double area = 1.3e-6;          ///< [m2]
};

struct EvacuatorDescription {
  std::string instrument;        ///< draws at its tip; empty: at `position`
  Vec3 position = Vec3::Zero();  ///< [m]
  double radius = 5e-3;          ///< within which particles are taken [m]
  double flow = 0.0;             ///< [m3/s]
  Interval when;
};

struct GasDescription {
  double pressure = 1600.0;     ///< over atmosphere, at first and as set [Pa]
  double temperature = 310.15;  ///< [K]
  double humidity = 0.0;        ///< relative
  int cells = 32;               ///< along the longest side; 0: the gas stands still
  std::optional<Box> domain;    ///< none: what holds all smoke volumes [m]
  double cavity = 3e-3;         ///< volume of the whole cavity at that pressure [m3]
  double compliance = CavityParameters().compliance;  ///< of its wall [m3/Pa]
  std::vector<InletDescription> inlets;
  std::vector<LeakDescription> leaks;
  std::vector<EvacuatorDescription> evacuators;

  /// CO2 at this temperature and this pressure over atmosphere.
  GasMixture mixture() const;
  CavityParameters cavity_parameters() const;
};

const GasDescription& gas_of(const SceneDescription& scene);

FeatureKeys gas_keys();

}  // namespace viscera
