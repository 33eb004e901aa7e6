// Pictures of what the benchmarks measured.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/verification/hemisphere_reference.h"
#include "kernels/base/result.h"
#include "tools/peers/hemisphere_case.h"

namespace viscera {

/// Writes into `folder` (made if need be): error_against_preparation, error_against_online,
/// cost_against_unknowns ([De2006] fig. 5c), deformed_profile (5b) and table_1, all SVG. Cases that
/// a plot doesn't need are left out of it; a plot without cases isn't written.
Result<void> draw_hemisphere_plots(const std::vector<HemisphereCase>& cases,
                                   const std::vector<HemisphereReference>& references,
                                   const std::filesystem::path& folder);

/// One solution on one cube.
struct ConvergenceCase {
  std::string formulation, basis;
  double poisson = 0.0;
  std::size_t nodes = 0;
  double error = 0.0;
  std::optional<double> order;  ///< from the next coarser cloud
  double solve_s = 0.0;         ///< assembly, factor and solution
};

/// convergence_nu0.30.svg and so on: error against nodes per side.
Result<void> draw_convergence_plots(const std::vector<ConvergenceCase>& cases,
                                    const std::filesystem::path& folder);

}  // namespace viscera
