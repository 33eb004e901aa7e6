// What a feature adds to the scene format: keys of a scene, an organ or an instrument, and how they
// are read.
#pragma once

#include <functional>
#include <vector>

#include "engine/scene/extras.h"
#include "engine/scene/keys.h"

namespace viscera {

struct FeatureKeys {
  /// Of one kind of object: keys that are checked, and what makes values of them, all keys that
  /// have a fallback being there.
  struct Part {
    std::vector<KeySpec> keys;
    std::function<void(const Json&, Extras&)> read;
  };
  Part scene, organ, instrument;
};

}  // namespace viscera
