#include "engine/features/coagulation/coagulation_keys.h"

namespace viscera {

bool stiffens(const OrganDescription& organ) {
  return !organ.extras.find<NeverStiffens>();
}

FeatureKeys coagulation_keys() {
  FeatureKeys keys;
  keys.organ.keys = {
      boolean("stiffens",
              "Whether tissue that a hook coagulates becomes stiffer and shrinks; what is under "
              "the fine part of its surface is prepared for it where hooks carry current.")
          .otherwise(true)};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (!organ["stiffens"].get<bool>()) extras.set(NeverStiffens());
  };
  return keys;
}

}  // namespace viscera
