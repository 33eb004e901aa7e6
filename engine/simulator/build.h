// The two halves of a simulator put together: the list of features, and what makes models and
// worlds.
#pragma once

#include "engine/features/features.h"
#include "engine/simulation/instruments.h"
#include "engine/simulation/prepare.h"
#include "engine/simulation/run_stages.h"

namespace viscera {

/// What a step's stages are called, in their order, and after them those about it (RunStage): the
/// names of a Trace.
std::vector<std::string> stage_names();
int stage_index(RunStage stage);

/// Every mistake that only a scene's parts together show (a tissue that lacks what an organ asks
/// for, a tip that nothing answers): before anything is prepared.
Result<void> check_together(const SceneDescription& scene,
                            const std::map<std::string, Tissue>& tissues);

/// Prepares every organ (from the cache where possible) and places all entities. Tips that start
/// inside an organ are refused as soon as its surface is known. `warnings` gets what a person
/// should know besides.
Result<std::unique_ptr<World>> build_world(const SceneDescription& scene,
                                           const std::map<std::string, Tissue>& tissues,
                                           const PrepareOptions& options, const Progress& progress,
                                           std::vector<std::string>& warnings);

/// The same as far as the model, which any number of worlds may share.
Result<std::shared_ptr<const SceneModel>> build_model(const SceneDescription& scene,
                                                      const std::map<std::string, Tissue>& tissues,
                                                      const PrepareOptions& options,
                                                      const Progress& progress,
                                                      std::vector<std::string>& warnings);

/// For who places the same organs more than once.
Result<OrganModels> prepare_organs(const SceneDescription& scene,
                                   const std::vector<InstrumentBody>& instruments,
                                   const std::map<std::string, Tissue>& tissues,
                                   const PrepareOptions& options, const Progress& progress,
                                   std::vector<std::string>& warnings);
Result<std::unique_ptr<World>> place_entities(const SceneDescription& scene,
                                              std::vector<InstrumentBody> instruments,
                                              const OrganModels& models,
                                              const std::map<std::string, Tissue>& tissues);

Reach reach_of(const std::vector<InstrumentBody>& instruments, const SceneDescription& scene,
               const OrganDescription& organ);

}  // namespace viscera
