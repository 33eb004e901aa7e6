// The world: entities, their components, and the clock. No globals: two worlds in one program are
// independent.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/components.h"
#include "engine/registry.h"
#include "engine/systems/gravity.h"

namespace viscera {

class GpuSurfaces;
class HapticTools;

struct World {
  EntityIds ids;

  Pool<OrganBody> organ_bodies;
  Pool<OrganMotion> organ_motions;
  std::optional<Gravity> gravity;  ///< where it changes and some organ sags
  Pool<OrganSag> organ_sags;
  Pool<OrganChange> organ_changes;
  Pool<OrganContact> organ_contacts;
  Pool<LocalOrgan> local_organs;
  Pool<OrganState> organ_states;
  Pool<OrganBurn> organ_burns;

  std::vector<Link> links;  ///< those with stiffness
  Pool<OrganTies> organ_ties;
  std::vector<std::vector<Entity>> link_groups;  ///< organs whose contact is solved together

  Pool<InstrumentBody> instrument_bodies;
  Pool<InstrumentState> instrument_states;
  Pool<InstrumentContact> instrument_contacts;
  Pool<BurnTrace> burn_traces;  ///< hooks only

  Pool<SmokeBody> smoke;
  GasBody gas;
  SmokeScenery smoke_scenery;
  SmokeOptics smoke_optics;

  std::shared_ptr<GpuSurfaces> gpu;  ///< deforms drawn surfaces; null: the CPU does

  std::shared_ptr<HapticTools> haptics;  ///< tools that are held; null: none is

  std::uint64_t tick = 0;   ///< 1 kHz ticks since the start; the time in ms
  std::uint64_t frame = 0;  ///< frames done
  double time() const { return static_cast<double>(tick) * 1e-3; }
};

/// Prepares every organ (from the cache where possible) and places all entities. Tips that start
/// inside an organ are refused as soon as its surface is known. `warnings` gets what a person
/// should know besides.
Result<std::unique_ptr<World>> build_world(const SceneDescription& scene,
                                           const std::map<std::string, Tissue>& tissues,
                                           const PrepareOptions& options, const Progress& progress,
                                           std::vector<std::string>& warnings);

/// The two halves of build_world, for who places the same organs more than once.
/// One model an organ of the scene, in their order; equal organs share one.
using OrganModels = std::vector<std::shared_ptr<const OrganModel>>;
Result<OrganModels> prepare_organs(const SceneDescription& scene,
                                   const std::vector<InstrumentBody>& instruments,
                                   const std::map<std::string, Tissue>& tissues,
                                   const PrepareOptions& options, const Progress& progress,
                                   std::vector<std::string>& warnings);
/// Places all entities; `models` are those of the scene's organs. Whether tips are clear of the
/// organs isn't asked again.
Result<std::unique_ptr<World>> place_entities(const SceneDescription& scene,
                                              std::vector<InstrumentBody> instruments,
                                              const OrganModels& models,
                                              const std::map<std::string, Tissue>& tissues);

/// The scene's instruments with their paths; imports mesh tips.
Result<std::vector<InstrumentBody>> make_instruments(const SceneDescription& scene);

/// Refuses instruments whose tips reach into this organ's surface at the start.
Result<void> check_tips(const SceneDescription& scene,
                        const std::vector<InstrumentBody>& instruments,
                        const OrganDescription& organ, const TriangleSurface& surface);

/// Where the instruments may touch this organ of the scene and links pull at it, in its own frame,
/// and whether it sags.
Reach reach_of(const std::vector<InstrumentBody>& instruments, const SceneDescription& scene,
               const OrganDescription& organ);

/// The organ's tissue with the scene's own elastic values in it.
Tissue tissue_of(const OrganDescription& organ, const std::map<std::string, Tissue>& tissues);

}  // namespace viscera
