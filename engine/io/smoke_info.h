#pragma once

#include <string>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

/// What a smoke volume's file holds: for `viscera smoke-info` and tests.
struct SmokeFileInfo {
  std::string volume;
  double time = 0.0;                                   ///< [s]
  double mass = 0.0;                                   ///< integral of density [kg]
  Vec3 least = Vec3::Zero(), greatest = Vec3::Zero();  ///< of its active voxels [m]
  std::size_t active_voxels = 0;
  double voxel = 0.0;  ///< [m]
  struct Grid {
    std::string name;
    std::string type;  ///< of its values, as OpenVDB calls it: "float", "vec3s"
    std::string unit;
    static constexpr auto fields() {
      return std::tuple(field("name", &Grid::name), field("type", &Grid::type),
                        field("unit", &Grid::unit));
    }
  };
  std::vector<Grid> grids;

  Box active_bounds() const { return active_voxels > 0 ? Box(least, greatest) : Box(); }

  static constexpr auto fields() {
    return std::tuple(field("volume", &SmokeFileInfo::volume), field("time", &SmokeFileInfo::time),
                      field("mass", &SmokeFileInfo::mass), field("least", &SmokeFileInfo::least),
                      field("greatest", &SmokeFileInfo::greatest),
                      field("active_voxels", &SmokeFileInfo::active_voxels),
                      field("voxel", &SmokeFileInfo::voxel), field("grids", &SmokeFileInfo::grids));
  }
};
static_assert(fields_cover<SmokeFileInfo::Grid>() && fields_cover<SmokeFileInfo>());

}  // namespace viscera
