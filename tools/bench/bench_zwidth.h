// `viscera bench zwidth`: the stiffest wall that a simulated device shows without rattling.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct ZWidthBenchOptions {
  bool quick = false;                 ///< three grips and three dampings
  std::vector<double> grips;          ///< from 0, loose, to 1, firm; empty: five of them
  std::vector<double> dampings;       ///< [N s/m] of the coupling; empty: from 0 to 20
  std::filesystem::path json, plots;  ///< empty: none is written
};

/// Greatest stable stiffness over grip and damping, with and without the passivity controller: a
/// table, JSON and a plot of stiffness against damping. Fails on a grip or damping that can't be.
Result<void> bench_zwidth(const ZWidthBenchOptions& options, std::ostream& out);

}  // namespace viscera
