// A small world with smoke.
#pragma once

#include "engine/scene/scene.h"

namespace viscera::test {

/// A soft ball and, over its pole, a place that gives 2e-6 kg/s of smoke, in gas of 16 cells along
/// its longest edge.
SceneDescription smoking_ball_scene();

}  // namespace viscera::test
