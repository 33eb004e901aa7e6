// One burn that others have made too: a ball electrode held on liver.
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
  double ball_radius = 1e-3;  ///< [m]
  double depth = 0.5e-3;      ///< pressed in [m]
  double voxel = 0.5e-3;      ///< [m]
  double dt = 1.0 / 60.0;     ///< [s]
};

struct BurnRow {
  double time = 0.0;
  Lesion lesion;
  CurrentReport current;
  double greatest = 0.0;  ///< so far [K]
  double water = 0.0;     ///< boiled so far [kg]
};

struct BurnResult {
  std::vector<BurnRow> rows;  ///< one a step
  HeatBook book;              ///< at the end
  double generated = 0.0;     ///< by the generator [J]
  std::size_t warm_voxels = 0;
};

/// On the flat surface of a body that fills half of space.
BurnResult make_burn(const StandardBurn& burn);

}  // namespace viscera
