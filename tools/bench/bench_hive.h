// `viscera bench hive`: what local hives cost and how far off they are, on the pressed hemisphere.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct HiveBenchOptions {
  bool quick = false;                 ///< fewer nodes and radii
  std::filesystem::path json, plots;  ///< empty: none is written
  // Empty: the benchmark's own choice.
  std::vector<int> nodes;
  std::vector<double> radii;           ///< of the hive, over R
  std::vector<double> poisson_ratios;  ///< those of assets/reference/hemisphere
};

/// A tool of radius 0.1 R presses the pole, without friction, at every formulation and periphery.
/// Errors are against assets/reference/hemisphere; the profile's over the dome within the hive.
/// Times are of one thread; the largest hive also travels, at 1 kHz (bench_hive_moving.h). Then
/// tissue beyond linear (bench_nonlinear_hive.h). Prints cases and figures to reach; writes JSON
/// and plots. Fails on options out of range, or on Ctrl-C.
Result<void> bench_hive(const HiveBenchOptions& options, std::ostream& out);

}  // namespace viscera
