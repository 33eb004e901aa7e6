// Jaws that pull until they slip: part of `viscera bench contact`.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// The pull at which jaws of so much force began to slide on a strip, against 2 mu N.
struct JawsSlip {
  std::string name;
  double value = 0.0, reference = 0.0;  ///< [N]
  double farthest = 0.0;                ///< of friction from the reference while they slid, a share
  double frame_ms = 0.0;                ///< median, while they hold and slide
  int rows = 0;                         ///< of the contact problem
};

/// Each jaw with 1, 2 and 4 N, on linear tissue and at finite strain. Fails where the strip can't
/// be prepared, and on Ctrl-C.
Result<std::vector<JawsSlip>> bench_jaws();

}  // namespace viscera
