// What a scene says of links.
#pragma once

#include <array>
#include <span>
#include <string>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// Springs between two organs' surfaces, or between one and the ground: a ligament, a gallbladder's
/// bed. Without tension where both organs stand undeformed at their poses.
struct LinkDescription {
  static constexpr const char* kGround = "ground";

  std::string name;
  std::array<std::string, 2> between;  ///< organs; at most one of them kGround, which never moves
  Region region;                       ///< sphere or box that holds both ends; world, organs at
                                       ///< their poses
  double stiffness = 0.0;              ///< of all springs together, in every direction [N/m]
};
/// An extra of scenes.
using LinkDescriptions = std::vector<LinkDescription>;

std::span<const LinkDescription> links_of(const SceneDescription& scene);

FeatureKeys links_keys();

}  // namespace viscera
