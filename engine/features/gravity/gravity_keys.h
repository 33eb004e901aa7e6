// What a scene says of gravity.
#pragma once

#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// How the table lies at one time; both angles 0: level, the patient on the back.
struct TableKey {
  double time = 0.0;       ///< [s]
  double head_up = 0.0;    ///< about the patient's x axis: the head rises over the feet [rad]
  double left_down = 0.0;  ///< about the table's long axis: the left side sinks [rad]
};

/// Gravity in the world's frame, which is the patient's and turns with the table. Organs have their
/// rest shapes under the gravity in which they were imaged: only what it differs from that moves
/// them.
struct GravityDescription {
  double acceleration = 9.81;            ///< [m/s2]
  Vec3 rest_direction = -Vec3::UnitZ();  ///< unit, of gravity while the organs were imaged
  std::vector<TableKey> table;           ///< times ascending; none: level

  /// False: gravity is always the one in which the organs were imaged.
  bool changes() const;
};

/// Of organs that no change of gravity moves.
struct NeverSags {};
/// Of organs whose holds alone bore them in their images.
struct HungInImage {};

/// Null: organs weigh nothing.
const GravityDescription* gravity_of(const SceneDescription& scene);
/// Whether a change of gravity moves it, if it is deformable.
bool sags(const OrganDescription& organ);

/// Whether its holds alone bore it while it was imaged. False: what it lay among did, as a fluid
/// would: then it had no stress but a pressure there.
bool hung_in_image(const OrganDescription& organ);

FeatureKeys gravity_keys();

}  // namespace viscera
