// What a scene says of a retrieval bag.
#pragma once

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// An extra of bags. The mouth is a ring beyond the tip, in the plane of the shaft and across the
/// jaws' way; the sack, half an ellipsoid, hangs from it to the side where jaws would open (down
/// with roll 0). Bags for shafts of 10 mm have mouths of some 60 to 70 mm and are some 150 mm deep
/// (recalled).
struct BagDescription {
  double mouth = 60e-3;   ///< width of the open ring [m]
  double depth = 100e-3;  ///< of the sack [m]
};

/// Null: it is no bag.
const BagDescription* bag_of(const InstrumentDescription& instrument);

FeatureKeys bag_keys();

}  // namespace viscera
