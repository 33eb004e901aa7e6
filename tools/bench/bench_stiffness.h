// What it costs to follow tissue that coagulates: updates of a body's compliance against their
// size.
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// One lesion, half a ball under the top of a block of liver.
struct StiffnessCost {
  double radius = 0.0;    ///< of the lesion [m]
  std::size_t nodes = 0;  ///< that it touches
  std::size_t rank = 0;   ///< of the update
  double update_s = 0.0;  ///< beside the frames
  double touch_s = 0.0;   ///< of a pressing tip's frame, its solve and its displacements, with it
  double sound_touch_s = 0.0;  ///< and without
  std::size_t bytes = 0;       ///< of the update
  double error =
      0.0;  ///< of the compliance against the body factored anew, over its greatest entry
};

struct StiffnessBench {
  std::size_t body_nodes = 0, places = 0, touchable = 0, region_nodes = 0;
  std::size_t region_bytes = 0;  ///< kept with the body for this
  double region_s = 0.0,
         factor_s = 0.0;  ///< preparing that, and a new factorisation with its compliance
  std::vector<StiffnessCost> costs;
};

/// Prints a line a lesion; `quick`: few nodes, two lesions. Fails where the body can't be prepared,
/// and on Ctrl-C.
Result<StiffnessBench> bench_stiffness(bool quick, std::ostream& out);

nlohmann::json to_json(const StiffnessBench& bench);

}  // namespace viscera
