// What the targets of scenes share.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/scene/load_scene.h"

namespace viscera::fuzz {

/// Reads a scene with the keys of all features. Files that it names are sought beside it alone.
bool is_scene(const std::string& text,
              const std::vector<std::pair<std::string, std::string>>& overrides = {});

/// Scenes that have every key between them.
std::vector<std::string> scenes();

}  // namespace viscera::fuzz
