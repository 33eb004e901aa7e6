// A body at finite strain that goes on as another one of the same tissue, as after a cut.
#pragma once

#include <vector>

namespace viscera {

struct Continuation {
  std::vector<int> nodes;   ///< of each node the one of before whose motion it takes           (N)
  std::vector<int> points;  ///< of each point of its region that of before's, where it was     (Q)
};

}  // namespace viscera
