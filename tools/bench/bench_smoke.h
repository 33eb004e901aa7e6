// `viscera bench smoke`: what the passes of smoke cost, with the decay error beside the speeds.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "engine/gpu/backend.h"
#include "kernels/base/result.h"

namespace viscera {

struct SmokeBenchOptions {
  Backend backend = Backend::kAuto;
  std::vector<std::string> particles = {"10k", "100k", "1M"};  ///< a case each
  int steps = 30;                                              ///< timed in a case
  int pictures = 9;                                            ///< drawn in a case; 0: none
  std::filesystem::path json, plots;                           ///< empty: none is written
};

/// Times every pass and the whole step on a SmokeCase of each size, draws pictures full of smoke
/// where there is a GL driver, and measures the decay of a shear wave by both Laplacians. Prints
/// all of it with targets and writes JSON and plots. Fails on bad options, where the backend that
/// is asked for can't be had, or on Ctrl-C; nothing is written then.
Result<void> bench_smoke(const SmokeBenchOptions& options, std::ostream& out);

}  // namespace viscera
