// What a feature adds to the scene format: keys of a scene, an organ or an instrument, and how they
// are read.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/scene/extras.h"
#include "engine/scene/keys.h"

namespace viscera {

struct FeatureKeys {
  /// Of one kind of object.
  struct Part {
    std::vector<KeySpec> keys;
    std::vector<ObjectCheck> checks;  ///< mistakes that show only beside other keys of the object
    /// What makes values of them, all keys that have a fallback being there.
    std::function<void(const Json&, Extras&)> read;
  };
  Part scene, organ, instrument;
  /// Where a key names an "organ" or an "instrument" (KeySpec::known_as): words that may stand for
  /// one.
  std::map<std::string, std::vector<std::string>> words;
};

}  // namespace viscera
