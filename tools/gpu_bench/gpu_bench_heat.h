// `viscera_gpu_bench heat`: how fast this machine's GPU moves heat, beside the error of what it
// computes.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct GpuHeatBenchArguments {
  std::vector<int> bricks = {2, 4, 6, 8, 12};  ///< along the edge of a cube, a case each
  int repeats = 30;
  int window_mb = 256;
  std::string json;
};

/// Prints a table and writes the JSON file, if one is named.
Result<void> bench_gpu_heat(const GpuHeatBenchArguments& arguments);

}  // namespace viscera
