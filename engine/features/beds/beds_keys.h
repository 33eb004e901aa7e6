// What a scene says of beds.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"
#include "kernels/contact/cohesive_law.h"

namespace viscera {

/// A layer of connective tissue that holds two organs together where their surfaces lie on each
/// other: bonds that soften and part by force or by heat.
struct BedDescription {
  std::string name;
  std::array<std::string, 2> between;  ///< organs
  Region region;                       ///< that holds it; world, organs at their poses
  double within = 0.0;                 ///< surfaces farther apart at rest aren't bonded [m]
  double pitch = 0.0;                  ///< of its bonds, at most [m]
  CohesiveLaw law;
  /// Of the film of peritoneum over its edge: forces over a length of edge [N/m, N/m2, J/m].
  std::optional<CohesiveLaw> film;
  double parts_at = 0.0;  ///< temperature of tissue at a bond's end that parts it [K]
};
/// An extra of scenes.
using BedDescriptions = std::vector<BedDescription>;

std::span<const BedDescription> beds_of(const SceneDescription& scene);

FeatureKeys beds_keys();

}  // namespace viscera
