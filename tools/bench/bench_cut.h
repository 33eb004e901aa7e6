// `viscera bench cut`: bodies that are cut, time against error.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "kernels/base/result.h"

namespace viscera {

struct CutBenchOptions {
  bool quick = false;                 ///< nodes 4 mm apart and more; no cut that goes on
  std::filesystem::path json, plots;  ///< empty: none is written
};

/// A block that is slit, or cut by blades, against finite elements; a crack under pressure against
/// its exact opening; a piece that is cut off; a scene's block as a scalpel goes through it. Prints
/// the cases with the figures to reach and writes JSON and plots. Fails where a body can't be
/// prepared, and on Ctrl-C.
Result<void> bench_cut(const CutBenchOptions& options, std::ostream& out);

}  // namespace viscera
