// Below the table of `viscera bench hemisphere`: single figures beside what they are to reach.
#pragma once

#include <string>
#include <vector>

#include "engine/verification/hemisphere_body.h"
#include "tools/common/bench_figures.h"
#include "tools/peers/hemisphere_case.h"

namespace viscera {

/// Median times of contact and displacement on one core [us].
struct OnlineTimes {
  double still = 0.0;   ///< the same patch again and again
  double moving = 0.0;  ///< a patch that slides along the dome
};

OnlineTimes measure_online(HemisphereBody& body, HemisphereContact contact, double a_over_R,
                           int rings);

/// A body that couldn't be prepared.
struct RefusedHemisphere {
  std::string formulation;
  double poisson = 0.0;
  std::size_t nodes = 0;
  std::string reason;
};

/// Worst errors over `cases`; cases without a solution and refused bodies are dropped, and listed.
std::vector<BenchRow> hemisphere_error_rows(const std::vector<HemisphereCase>& cases,
                                            const std::vector<RefusedHemisphere>& refused);

/// These, time of a contact, bandwidth; without `quick` also the main scene against itself on half
/// its node spacing, and large preparations. Fails on Ctrl-C.
Result<std::vector<BenchRow>> hemisphere_rows(const std::vector<HemisphereCase>& cases,
                                              const std::vector<RefusedHemisphere>& refused,
                                              bool quick);

}  // namespace viscera
