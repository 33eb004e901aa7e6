// What a scene says of clips, and of the ducts and vessels that they close.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// An extra of clip appliers: the clips that they are loaded with.
struct ClipsDescription {
  int count = 1;
  double length = 9e-3;   ///< of a bar, from the tip back along the shaft [m]
  double width = 1e-3;    ///< of a bar, across [m]
  double opening = 9e-3;  ///< between the bars before it closes [m]
  double gap = 0.5e-3;    ///< between them once it is shut [m]
  double holds = 40e3;    ///< pressure of a lumen that it closes, shut; recalled [Pa]
};

/// What flows through an organ that is solid here: a line through it.
struct DuctDescription {
  enum class Fed { kStart, kEnd, kBoth };
  std::string name;
  std::vector<Vec3> path;  ///< organ's frame [m]
  double pressure = 0.0;   ///< inside, over that around the organ [Pa]
  Fed fed = Fed::kStart;   ///< the ends that it would go on flowing from, were it cut
};
/// An extra of organs.
struct DuctsDescription {
  std::vector<DuctDescription> ducts;
};

/// Null: it applies no clips.
const ClipsDescription* clips_of(const InstrumentDescription& instrument);
std::span<const DuctDescription> ducts_of(const OrganDescription& organ);

FeatureKeys clips_keys();

}  // namespace viscera
