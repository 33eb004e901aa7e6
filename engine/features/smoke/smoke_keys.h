// What a scene says of smoke.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/interval.h"
#include "engine/scene/scene.h"
#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// A hook whose burns give smoke, by its name, or a place that gives smoke steadily.
struct EmitterDescription {
  std::string instrument;          ///< empty: a place
  Vec3 position = Vec3::Zero();    ///< [m]
  Vec3 direction = Vec3::UnitZ();  ///< unit
  double radius = 1.5e-3;          ///< of the ball [m]
  double rate = 0.0;               ///< of smoke [kg/s]
  double particles = 1000.0;       ///< [1/s]
  double speed = 0.12;             ///< of the jet [m/s]
  double excess = 60.0;            ///< over the gas [K]
  Interval when;
};

enum class SmokeLook { kMarch, kSprites };

struct SmokeDescription {
  std::string name;
  Box domain;           ///< [m]
  double voxel = 2e-3;  ///< of the written volume [m]
  int max_particles = 25000;
  double spacing = 3e-3;  ///< support radius of the particles' kernels [m]
  Laplacian laplacian = Laplacian::kPairwise;
  double lifetime = 20.0;        ///< of a particle [s]
  double particle_mass = 1e-10;  ///< of one that a burn gives off [kg]
  SmokeLook look = SmokeLook::kMarch;
  std::vector<EmitterDescription> emitters;  ///< empty: every hook that burns in the domain
};
/// An extra of scenes.
using SmokeDescriptions = std::vector<SmokeDescription>;

std::span<const SmokeDescription> smoke_of(const SceneDescription& scene);

FeatureKeys smoke_keys();

}  // namespace viscera
