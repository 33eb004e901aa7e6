// `viscera bench bodies`: time against error where the body decides what a contact feels, not the
// half-space's closed form.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct BodiesBenchOptions {
  bool quick = false;                 ///< one number of nodes
  std::filesystem::path json, plots;  ///< empty: none is written
  // Named cases alone; empty: the benchmark's own choice.
  // Bodies are those of body_cases(), and sphere_0.4, sphere_0.6, sphere_0.8.
  std::vector<std::string> bodies;
  std::vector<std::string> formulations;
  std::vector<std::size_t> nodes;
  std::vector<double> poisson_ratios;
  /// Not empty: solves the references anew by finite elements, of the named bodies or of all, and
  /// writes them here instead (minutes to hours).
  std::filesystem::path references;

  bool names_cases() const {
    return !bodies.empty() || !formulations.empty() || !nodes.empty() || !poisson_ratios.empty();
  }
};

/// Runs the cases, prints them with the figures to reach and writes JSON and plots. Fails where a
/// named case can't be run, or on Ctrl-C.
Result<void> bench_bodies(const BodiesBenchOptions& options, std::ostream& out);

}  // namespace viscera
