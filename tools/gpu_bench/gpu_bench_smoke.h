// `viscera_gpu_bench smoke`: how fast this machine's GPU moves smoke, beside the error of what it
// computes.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct SmokeBenchArguments {
  std::vector<std::string> particles = {"10k", "100k", "1M"};
  int repeats = 30;
  double voxel_mm = 2.0;  ///< of the splatted grid
  int window_mb = 256;
  bool paper = false;  ///< times the paper's Laplacian in place of the default
  std::string json;
};

/// Prints a table and writes the JSON file, if one is named.
Result<void> bench_smoke(const SmokeBenchArguments& arguments);

}  // namespace viscera
