// Pictures of what `viscera bench heat` measured.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/features/cautery/cautery_keys.h"
#include "engine/gpu/backend.h"
#include "engine/verification/standard_burn.h"

namespace viscera {

/// Greatest error near a lesion's edge, over the temperature's rise there.
struct HeatError {
  double voxel = 0.0;  ///< [m]
  double dt = 0.0;     ///< [s]
  double error = 0.0;
};

struct HeatTime {
  std::size_t voxels = 0;  ///< in warm bricks
  double step_s = 0.0;     ///< median
  Backend backend = Backend::kCpu;
  std::string device;  ///< the machine's processor or the driver's name
};

/// Writes heat_error.svg, heat_time.svg and heat_lesion.svg into the folder, which is made if need
/// be.
Result<void> draw_heat_plots(const std::vector<HeatError>& errors,
                             const std::vector<HeatTime>& times, const BurnResult& burn,
                             const PublishedLesion& published, const std::filesystem::path& folder);

}  // namespace viscera
