// `viscera bench convergence`: error and order on a smooth solution, for every formulation.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct ConvergenceBenchOptions {
  bool quick = false;                     ///< leaves the finest clouds out
  std::filesystem::path json, plots;      ///< empty: none is written
  std::vector<std::string> formulations;  ///< empty: all
};

/// Cubes of 512, 1,331 and 4,913 nodes with jitter 0.2 at Poisson's ratio 0.30, 0.45 and 0.49;
/// prints error and order with targets and writes JSON and plots.
Result<void> bench_convergence(const ConvergenceBenchOptions& options, std::ostream& out);

}  // namespace viscera
