#include "engine/features/bag/bag_keys.h"

#include "engine/scene/to_si.h"

namespace viscera {

const BagDescription* bag_of(const InstrumentDescription& instrument) {
  return instrument.extras.find<BagDescription>();
}

FeatureKeys bag_keys() {
  FeatureKeys keys;
  keys.instrument.keys = {
      number("mouth_mm",
             "Width of a bag's open mouth, a ring beyond the tip. As it closes (jaw below .5) the "
             "bag keeps the pieces that were cut off and lie in its sack.")
          .between(5, 200)
          .otherwise(60.0)
          .only_where("kind", {"bag"}),
      number("depth_mm", "How far a bag's sack hangs from its mouth.")
          .between(5, 300)
          .otherwise(100.0)
          .only_where("kind", {"bag"})};
  keys.instrument.read = [](const Json& instrument, Extras& extras) {
    if (!instrument.contains("mouth_mm")) return;
    extras.set(
        BagDescription{from_milli(instrument["mouth_mm"]), from_milli(instrument["depth_mm"])});
  };
  return keys;
}

}  // namespace viscera
