// A feature: one room of engine/features that brings its keys of the scene, its components, its
// part of a step and its section of the report. The list of them (engine/features/features.cpp)
// makes the simulator; nothing else names one.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/report_section.h"
#include "engine/scene/feature_keys.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/prepare.h"
#include "engine/simulation/state_type.h"

namespace viscera {

struct Continuation;

/// A part of a step. Where in the step it comes follows from what it reads and writes (schedule.h).
struct Stage {
  std::string_view name;                     ///< for profile, report and trace: "heat tissue"
  std::vector<std::string_view> reads = {};  ///< as this step has made it
  std::vector<std::string_view> reads_before = {};  ///< as the last step left it
  std::vector<std::string_view> writes = {};        ///< in both: changes what others have written
  std::vector<std::string_view> changes = {};       ///< states, by their types' kName
  bool (*needed)(const World&) = nullptr;  ///< null: always; else a scene may do without it
  void (*run)(World&, const FrameContext&) = nullptr;
};

struct Feature {
  std::string_view name;
  FeatureKeys keys = {};
  /// What can't be as only the scene's parts together show, before anything is prepared.
  Result<void> (*check)(const SceneDescription&, const std::map<std::string, Tissue>&) = nullptr;
  /// Where it needs an organ's elasticity: adds to the organ's reach.
  void (*reach)(const SceneDescription&, const OrganDescription&,
                const std::vector<InstrumentBody>&, Reach&) = nullptr;
  /// What a person should know of the prepared organs.
  void (*warn_of_models)(const SceneDescription&, const OrganModels&,
                         std::vector<std::string>& warnings) = nullptr;
  /// Its constants, once a model, after organs and instruments.
  Result<void> (*prepare)(SceneModel&) = nullptr;
  /// What else a model needs from the project's assets, and what a person should know of it.
  Result<void> (*finish)(SceneModel&, const std::filesystem::path& assets,
                         std::vector<std::string>& warnings) = nullptr;
  /// Its state and runtime, once a world.
  Result<void> (*start)(World&) = nullptr;
  /// The types of state that it has: state_type<T>().
  std::vector<StateType> states = {};
  std::vector<Stage> stages = {};
  /// That its stages raise.
  std::vector<FrameFlag> flags = {};
  /// Adds its part to an organ's FreeShape::places [m]; false: it moves nothing.
  bool (*shape)(const World&, Entity organ, std::vector<float>& places) = nullptr;
  /// An organ is another body than it was (World::replace): makes anew what follows from it.
  void (*replaced)(World&, Entity organ, const Continuation*) = nullptr;
  /// While a state is loaded, once those of StateType::of_bodies are there: replaces bodies that
  /// are others in it. Fails where they can't be made.
  Result<void> (*bodies_loaded)(World&) = nullptr;
  /// After a state has been loaded: makes what follows from it.
  void (*restored)(World&) = nullptr;
  /// Why a world with it can't be saved; empty: it can.
  std::string (*unsavable)(const World&) = nullptr;
  /// Its sections of report.json.
  std::vector<ReportSection> (*report)(const World&) = nullptr;
  /// What a person should know of a run that is over.
  std::vector<std::string> (*warnings)(const World&) = nullptr;
  /// What of it this scene doesn't need, and why.
  std::vector<SkippedReport> (*skipped)(const SceneDescription&) = nullptr;
};

/// All that a step may raise: the sentinel's, then theirs in their order.
std::vector<FrameFlag> flags_of(const std::vector<Feature>& features);

}  // namespace viscera
