// Scenes that tests spoil.
#pragma once

#include "engine/scene/json_file.h"

namespace viscera::test {

/// A scene that has every key of the format at least once. Needs ball.obj beside it and the recipes
/// of SceneFolder.
Json whole_scene();

/// The least that loads.
Json least_scene();

}  // namespace viscera::test
