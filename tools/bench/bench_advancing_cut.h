// A scalpel that goes through a block which two graspers draw apart: what a frame takes, how late
// the tissue opens, and what the graspers' force errs by meanwhile.
#pragma once

#include "kernels/base/result.h"

namespace viscera {

struct AdvancingCut {
  std::size_t nodes = 0;     ///< of the whole block
  double spacing = 0.0;      ///< of its nodes about the cut [m]
  double speed = 0.0;        ///< of the blade [m/s]
  double frame = 0.0;        ///< the tissue's part of one while the blade goes on, median [s]
  double worker = 0.0;       ///< to prepare one cut body beside the frames, at most [s]
  double frames_late = 0.0;  ///< from where the blade was to the body that knows it, at most
  /// Of the graspers' force as the blade passes, against what it comes to once the blade has waited
  /// at the same place, at most: over that force, and over what the whole cut changes it by.
  double force_error = 0.0, missing = 0.0;
};

/// The shipped scene `incision` with finer nodes, an elastic tissue and a blade that waits on its
/// way. Fails where the scene isn't found or can't be prepared, and on Ctrl-C.
Result<AdvancingCut> advancing_cut();

}  // namespace viscera
