// `viscera bench hemisphere`: time against error on the body of the reference, for every
// formulation, with the figures to reach.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct HemisphereBenchOptions {
  bool quick = false;                 ///< under two minutes
  bool peers = false;                 ///< finite elements and Bullet on the same hemisphere
  std::filesystem::path json, plots;  ///< empty: none is written
  // Named cases alone; empty: the benchmark's own choice.
  std::vector<std::string> formulations;
  std::vector<std::size_t> nodes;
  std::vector<double> poisson_ratios;
  std::vector<double> radii;  ///< a / R
  std::vector<std::string> contacts;
  bool graded = false;           ///< nodes finer about the pole
  double touchable_zone = 0.75;  ///< see HemisphereOptions

  bool names_cases() const {
    return !formulations.empty() || !nodes.empty() || !poisson_ratios.empty() || !radii.empty() ||
           !contacts.empty();
  }
};

/// Runs the cases, prints them with targets and writes JSON and plots. Fails where a named case
/// can't be run, or on Ctrl-C.
Result<void> bench_hemisphere(const HemisphereBenchOptions& options, std::ostream& out);

}  // namespace viscera
