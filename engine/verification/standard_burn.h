// Burns as others have made them: a ball electrode, or two, held on tissue.
#pragma once

#include <vector>

#include "kernels/heat/electrode.h"
#include "kernels/heat/lesion.h"

namespace viscera {

struct StandardBurn {
  ThermalTissue tissue;  ///< liver
  CurrentMode mode = CurrentMode::kBlend;
  double power = 30.0;  ///< [W]
  double seconds = 3.0;
  double ball_radius = 1e-3;          ///< [m]
  double depth = 0.5e-3;              ///< pressed in [m]
  double apart = 0.0;                 ///< of a bipolar's two balls; 0: one, and a return pad [m]
  double rest = kZeroCelsius + 37.0;  ///< temperature of the tissue before [K]
  double voxel = 0.5e-3;              ///< [m]
  double dt = 1.0 / 60.0;             ///< [s]
};

/// Muscle outside of a body: without blood, at room temperature. Values as the abdominal wall's in
/// assets/tissues.json.
ThermalTissue muscle_outside();
inline constexpr double kRoom = kZeroCelsius + 22.0;  ///< [K] [R]
/// Beyond it nerves are taken to be harmed [Hefermehl2014] [K].
inline constexpr double kCritical = kZeroCelsius + 45.0;

struct BurnRow {
  double time = 0.0;
  Lesion lesion;  ///< of what has blanched
  Lesion dead;    ///< of what won't live
  CurrentReport current;
  double greatest = 0.0;  ///< so far [K]
  double water = 0.0;     ///< boiled so far [kg]
};

struct BurnResult {
  std::vector<BurnRow> rows;  ///< one a step
  HeatBook book;              ///< at the end
  double generated = 0.0;     ///< by the generator [J]
  std::size_t warm_voxels = 0;
  /// Of the outermost layer at the end, voxel after voxel from the contact's middle on [K].
  std::vector<double> surface;
  double warm_area = 0.0;  ///< of that layer at the end, over kCritical [m2]

  /// How far from the middle the surface is warmer than that [m].
  double reach_of(double kelvin, double voxel) const;
};

/// On the flat surface of a body that fills half of space. Two balls share the power and have
/// neither body nor pad in series. Each has the field of a ball alone: what their fields take from
/// each other between them and beyond is left out.
BurnResult make_burn(const StandardBurn& burn);

}  // namespace viscera
