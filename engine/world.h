// The world: entities, their components, and the clock. No globals: two worlds in one program are
// independent.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/components.h"
#include "engine/registry.h"

namespace viscera {

struct World {
  EntityIds ids;

  Pool<OrganBody> organ_bodies;
  Pool<OrganContact> organ_contacts;
  Pool<OrganState> organ_states;
  Pool<OrganBurn> organ_burns;

  Pool<InstrumentBody> instrument_bodies;
  Pool<InstrumentState> instrument_states;
  Pool<InstrumentContact> instrument_contacts;
  Pool<BurnTrace> burn_traces;               ///< hooks only

  Pool<SmokeBody> smoke;

  std::uint64_t tick = 0;                    ///< 1 kHz ticks since the start; the time in ms
  std::uint64_t frame = 0;                   ///< frames done
  double time() const { return static_cast<double>(tick) * 1e-3; }
};

struct WorldOptions {
  PrepareOptions prepare;
};

/// What preparation has to say besides the world itself.
struct WorldNotes {
  std::vector<std::string> warnings;
};

/// Prepares every organ (from the cache where possible) and places all entities.
Result<std::unique_ptr<World>> build_world(const SceneDescription& scene,
                                           const std::map<std::string, Tissue>& tissues,
                                           const WorldOptions& options, const Progress& progress,
                                           WorldNotes& notes);

/// Refuses tips that start inside an organ; builds the shapes of organs alone.
Result<void> check_tips(const SceneDescription& scene, const std::filesystem::path& assets);

/// Where the scene's instruments may touch this organ, in its own frame.
Reach reach_of(const SceneDescription& scene, const OrganDescription& organ);

}  // namespace viscera
