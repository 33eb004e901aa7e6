// `viscera bench heat`: what a step of heat costs, with its error against closed forms and a
// lesion's size.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "kernels/base/result.h"

namespace viscera {

struct HeatBenchOptions {
  bool quick = false;                 ///< without the finest voxels and the most of them
  std::filesystem::path json, plots;  ///< empty: none is written
};

/// Error of a Gaussian source's temperature at the lesion's edge against voxel and step, time of a
/// step against active voxels, and the standard burn with its energy book. Prints all of it with
/// targets and writes JSON and plots. Fails on Ctrl-C; nothing is written then.
Result<void> bench_heat(const HeatBenchOptions& options, std::ostream& out);

}  // namespace viscera
