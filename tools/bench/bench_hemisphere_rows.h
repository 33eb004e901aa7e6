// Below the table of `viscera bench hemisphere`: single figures beside what they are to reach.
#pragma once

#include <iosfwd>
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

/// Worst errors over `cases`, time of a contact, bandwidth; without `quick` also the main scene
/// against itself on half its node spacing, and large preparations. What can't be measured is said
/// to `out`. Fails on Ctrl-C.
Result<std::vector<BenchRow>> hemisphere_rows(const std::vector<HemisphereCase>& cases, bool quick,
                                              std::ostream& out);

}  // namespace viscera
