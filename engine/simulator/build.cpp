#include "engine/simulator/build.h"

#include <algorithm>

#include "engine/simulation/run_stages.h"

namespace viscera {

std::vector<std::string> stage_names() {
  std::vector<std::string> names;
  for (const Stage& stage : step_schedule().stages()) names.emplace_back(stage.name);
  names.insert(names.end(), kRunStageNames.begin(), kRunStageNames.end());
  return names;
}

int stage_index(RunStage stage) {
  return static_cast<int>(step_schedule().stages().size()) + static_cast<int>(stage);
}

Result<void> check_together(const SceneDescription& scene,
                            const std::map<std::string, Tissue>& tissues) {
  Error mistakes;
  const auto take = [&](const Result<void>& sound) {
    if (sound) return;
    const std::vector<std::string>& found = sound.error().messages;
    mistakes.messages.insert(mistakes.messages.end(), found.begin(), found.end());
  };
  take(check_materials(scene, tissues));
  for (const Feature& feature : all_features())
    if (feature.check) take(feature.check(scene, tissues));
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

Result<std::shared_ptr<const SceneModel>> build_model(const SceneDescription& scene,
                                                      const std::map<std::string, Tissue>& tissues,
                                                      const PrepareOptions& options,
                                                      const Progress& progress,
                                                      std::vector<std::string>& warnings) {
  if (auto sound = check_together(scene, tissues); !sound) return std::unexpected(sound.error());
  auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  auto organs = prepare_organs(scene, *instruments, tissues, options, progress, warnings);
  if (!organs) return std::unexpected(organs.error());
  auto model =
      make_model(scene, std::move(*instruments), *organs, tissues, all_features(), step_schedule());
  if (!model) return std::unexpected(model.error());
  for (const Feature& feature : all_features())
    if (feature.finish)
      if (auto finished = feature.finish(**model, options.assets, warnings); !finished)
        return std::unexpected(finished.error());
  return *model;
}

Result<std::unique_ptr<World>> build_world(const SceneDescription& scene,
                                           const std::map<std::string, Tissue>& tissues,
                                           const PrepareOptions& options, const Progress& progress,
                                           std::vector<std::string>& warnings) {
  auto model = build_model(scene, tissues, options, progress, warnings);
  if (!model) return std::unexpected(model.error());
  return start_world(*model);
}

Result<OrganModels> prepare_organs(const SceneDescription& scene,
                                   const std::vector<InstrumentBody>& instruments,
                                   const std::map<std::string, Tissue>& tissues,
                                   const PrepareOptions& options, const Progress& progress,
                                   std::vector<std::string>& warnings) {
  return prepare_organs(scene, instruments, tissues, options, all_features(), progress, warnings);
}

Result<std::unique_ptr<World>> place_entities(const SceneDescription& scene,
                                              std::vector<InstrumentBody> instruments,
                                              const OrganModels& models,
                                              const std::map<std::string, Tissue>& tissues) {
  auto model =
      make_model(scene, std::move(instruments), models, tissues, all_features(), step_schedule());
  if (!model) return std::unexpected(model.error());
  return start_world(*model);
}

Reach reach_of(const std::vector<InstrumentBody>& instruments, const SceneDescription& scene,
               const OrganDescription& organ) {
  return reach_of(instruments, scene, organ, all_features());
}

}  // namespace viscera
