// Many organs out of one scene: what `viscera profile` steps.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/simulation/prepare.h"

namespace viscera {

/// Organs of a scene, each standing in a berth of its own, so that nothing meets its neighbours.
struct Berths {
  /// The first organ to be placed comes first; of more organs than these the order begins again.
  std::vector<std::size_t> order;
  Box occupied;  ///< by all organs and tips of the scene at all times, world [m]

  std::size_t organ_at(std::size_t berth) const { return order[berth % order.size()]; }
  /// From the scene's own place to the berth's [m]; none for the first.
  Vec3 offset(std::size_t berth) const;
};

/// Where the scene's organs and tips ever are; `models` are those of its organs.
Box occupied_by(const SceneDescription& scene, const std::vector<InstrumentBody>& instruments,
                const OrganModels& models);

struct Occupancy {
  std::size_t organs = 0;
  std::size_t touched = 0;  ///< of the first organs; each meets all instruments of the scene
  std::size_t tools = 0;  ///< sets of instruments; those that touch nothing move where no organ is
};

/// The scene with so many organs and instruments; an organ is `models[organ_at(berth)]`. An organ
/// that stands alone is met as in the scene, but for what its neighbours there would have held off.
SceneDescription fill_berths(const SceneDescription& scene, const Berths& berths,
                             const Occupancy& wanted);
OrganModels models_of(const OrganModels& models, const Berths& berths, std::size_t organs);

/// Steps back along the scene's first view until the whole world is in the picture; the scene has a
/// camera.
CameraDescription camera_on_all(const SceneDescription& scene, const World& world);

}  // namespace viscera
