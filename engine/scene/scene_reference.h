// The table of a scene file's keys as a document for people: the text of docs/scene.md.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/feature_keys.h"

namespace viscera {

/// Markdown: a section for each object that a scene may hold, with a table of its keys: meaning,
/// expected values, default. Made from the table that load_scene checks against, with what these
/// features add.
std::string scene_reference(const std::vector<FeatureKeys>& features);

}  // namespace viscera
