// Scene files: JSON with comments, published schema scenes/scene.schema.json.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"
#include "kernels/base/result.h"

namespace viscera {

struct SceneLoadOptions {
  std::filesystem::path assets;               ///< the project's assets folder
  std::vector<std::filesystem::path> search;  ///< extra folders for geometry files (--assets)
  /// `--set key=value` overrides, e.g. {"organs/0/resolution/finest_spacing_mm", "2.5"} or
  /// {"duration_s", "3"}; organs and instruments may be named: "organs/liver/tissue". Applied
  /// before validation, and validated like the file.
  std::vector<std::pair<std::string, std::string>> overrides;
  std::vector<FeatureKeys> features;  ///< whose keys a scene may have
};

/// Reads, validates and converts to SI. Every mistake of the file is in the error, each as
/// "FILE: KEY.PATH: found WHAT, expected WHAT (did you mean ...?)".
Result<SceneDescription> load_scene(const std::filesystem::path& file,
                                    const SceneLoadOptions& options);

/// The JSON Schema (2020-12) of a scene file, made from the table of keys that load_scene checks
/// against: the text of scenes/scene.schema.json.
std::string scene_schema(const std::vector<FeatureKeys>& features = {});

}  // namespace viscera
