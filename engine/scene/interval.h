// When something flows: keys of the scene, and their value.
#pragma once

#include <limits>
#include <vector>

#include "engine/scene/keys.h"

namespace viscera {

/// Times in seconds of the scene.
struct Interval {
  double from = 0.0;
  double to = std::numeric_limits<double>::infinity();
  bool contains(double time) const { return time >= from && time < to; }
};

/// All the time where both keys are left out.
std::vector<KeySpec> interval_keys();
ObjectCheck interval_in_order();
Interval interval_of(const Json& values);

}  // namespace viscera
