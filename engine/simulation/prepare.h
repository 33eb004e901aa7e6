// From a scene to its model, and from a model to a world.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/organ/organ_model.h"
#include "engine/simulation/world.h"

namespace viscera {

/// One a scene's organ, in their order; equal organs share one.
using OrganModels = std::vector<std::shared_ptr<const OrganModel>>;

/// Where the instruments may touch this organ of the scene and features pull at it, in its own
/// frame.
Reach reach_of(const std::vector<InstrumentBody>& instruments, const SceneDescription& scene,
               const OrganDescription& organ, const std::vector<Feature>& features);

/// The organ's tissue with the scene's own elastic values in it.
Tissue tissue_of(const OrganDescription& organ, const std::map<std::string, Tissue>& tissues);

/// Prepares every organ, from the cache where possible. Tips that start inside an organ are refused
/// as soon as its surface is known. `warnings` gets what a person should know besides.
Result<OrganModels> prepare_organs(const SceneDescription& scene,
                                   const std::vector<InstrumentBody>& instruments,
                                   const std::map<std::string, Tissue>& tissues,
                                   const PrepareOptions& options,
                                   const std::vector<Feature>& features, const Progress& progress,
                                   std::vector<std::string>& warnings);

/// Puts organs, instruments and the features' constants together; `models` are those of the scene's
/// organs. Whether tips are clear of the organs isn't asked again.
Result<std::shared_ptr<SceneModel>> make_model(const SceneDescription& scene,
                                               std::vector<InstrumentBody> instruments,
                                               const OrganModels& models,
                                               const std::map<std::string, Tissue>& tissues,
                                               const std::vector<Feature>& features,
                                               const Schedule& schedule);

/// A world at its beginning.
Result<std::unique_ptr<World>> start_world(std::shared_ptr<const SceneModel> model);

}  // namespace viscera
