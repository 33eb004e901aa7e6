// What a scene is before its first step: prepared once, never changed, shared by all its worlds.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/io/memory_limit.h"
#include "engine/simulation/components.h"
#include "engine/simulation/store.h"

namespace viscera {

struct Feature;
class Schedule;

class SceneModel {
 public:
  SceneModel(SceneDescription scene, std::map<std::string, Tissue> tissues,
             const std::vector<Feature>& features, const Schedule& schedule)
      : scene_(std::move(scene)),
        tissues_(std::move(tissues)),
        features_(&features),
        schedule_(&schedule) {}

  const SceneDescription& scene() const { return scene_; }
  const std::map<std::string, Tissue>& tissues() const { return tissues_; }
  const std::vector<Feature>& features() const { return *features_; }
  const Schedule& schedule() const { return *schedule_; }
  const Store& constants() const { return constants_; }
  const std::vector<Entity>& organs() const { return organs_; }  ///< in the scene's order
  const std::vector<Entity>& instruments() const { return instruments_; }
  /// Of a step [s]: what is prepared may depend on it, another length is another model.
  double time_step() const { return steps().step(); }
  const StepRate& steps() const { return scene_.steps; }

  // --- while it is made ---
  Store& constants() { return constants_; }
  /// From which features set aside what they will take.
  MemoryBudget& memory() { return memory_; }
  Entity add_organ(OrganBody body) {
    organs_.push_back(ids_.create());
    constants_.all<OrganBody>().add(organs_.back(), std::move(body));
    return organs_.back();
  }
  Entity add_instrument(InstrumentBody body) {
    instruments_.push_back(ids_.create());
    constants_.all<InstrumentBody>().add(instruments_.back(), std::move(body));
    return instruments_.back();
  }
  Entity add_entity() { return ids_.create(); }
  /// The instrument of this name; a stale entity where there is none.
  Entity instrument_named(const std::string& name) const {
    for (std::size_t i = 0; i < instruments_.size(); ++i)
      if (scene_.instruments[i].name == name) return instruments_[i];
    return {};
  }

 private:
  SceneDescription scene_;
  std::map<std::string, Tissue> tissues_;
  MemoryBudget memory_;
  const std::vector<Feature>* features_;
  const Schedule* schedule_;
  EntityIds ids_;
  Store constants_;
  std::vector<Entity> organs_, instruments_;
};

}  // namespace viscera
