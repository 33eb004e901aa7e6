// What a scene says of tissue that parts: which organs may be cut, and by which blades.
#pragma once

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// An extra of organs that may be cut.
struct CuttableDescription {
  double voxel = 0.25e-3;  ///< edge of the voxels that know what is gone [m]
  bool tears = false;      ///< where it is pulled beyond its tissue's ultimate strain
};

/// An extra of hollow organs, which are solid here.
struct WallDescription {
  double thickness = 0.0;  ///< [m]
};

/// An extra of scalpels, an edge from the tip back along the shaft, and of scissors, two that swing
/// about a hinge so far back and cut as they close.
struct BladeDescription {
  double length = 10e-3;      ///< [m]
  double thickness = 0.4e-3;  ///< [m]
};

/// An extra of instruments whose jaws may bring pieces out through their trocar.
struct BoreDescription {
  double bore = 12e-3;  ///< of the trocar [m]; 12 mm is the widest common one (recalled)
};

/// Null: it can't be cut.
const CuttableDescription* cuttable_of(const OrganDescription& organ);
/// Null: nothing is said of one.
const WallDescription* wall_of(const OrganDescription& organ);
/// Null: it has none.
const BladeDescription* blade_of(const InstrumentDescription& instrument);
/// Of the trocar that it goes through, as far as pieces are concerned [m].
double bore_of(const InstrumentDescription& instrument);

FeatureKeys parting_keys();

}  // namespace viscera
