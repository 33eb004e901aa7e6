// The part of `viscera bench hive` that goes beyond linear: a ball on flat, deep tissue.
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/hive/hyperelastic_model.h"
#include "tools/common/bench_figures.h"

namespace viscera {

struct NonlinearBench {
  std::vector<double> poisson_ratios;
  bool quick = false;  ///< fewer grids
};

struct NonlinearBenchOutcome {
  nlohmann::json cases() const;
  std::vector<BenchRow> rows() const;

  struct Case {
    HyperelasticModel model{};
    double poisson = 0.0, depth = 0.0;  ///< over the ball's radius
    int nodes = 0, unknowns = 0, cells = 0;
    double force_error = 0.0;               ///< against the block that the ball is pressed into
    double linear_error = 0.0;              ///< of the linear hive, against the same
    double steps = 0.0;                     ///< Newton's, in a tick
    double tick_p50 = 0.0, tick_p99 = 0.0;  ///< seated and pressed [us]
    int ticks = 0, tangent_answers = 0, deadline_misses = 0;
    bool settled = true;  ///< the answer whose error is told; else along its last tangent
  };
  std::vector<Case> all;
  /// Of neo-Hookean tissue, depths without a reference: no equilibrium was found there.
  std::vector<std::string> without_reference;
};

/// A ball goes in at 25 mm/s to each depth and out again; times with the servo's deadline, errors
/// without. Prints cases. Fails on Ctrl-C.
Result<NonlinearBenchOutcome> bench_nonlinear_hive(const NonlinearBench& options,
                                                   std::ostream& out);

}  // namespace viscera
