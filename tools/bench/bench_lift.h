// `viscera bench lift`: organs at finite strain, time a frame against error of force and shape.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct LiftBenchOptions {
  bool quick = false;                 ///< without the larger bodies
  bool peers = false;                 ///< CalculiX on the block, too, where it is installed
  std::filesystem::path json, plots;  ///< empty: none is written
  std::vector<std::string> cases;     ///< these alone; empty: all
  std::vector<int> iterations;        ///< a frame; empty: 1, 2, 4
};

/// Runs the cases, prints them with the figures to reach and writes JSON and plots. Fails where a
/// named case doesn't exist or can't be run, or on Ctrl-C.
Result<void> bench_lift(const LiftBenchOptions& options, std::ostream& out);

}  // namespace viscera
