// A small scene with nearly every feature.
#pragma once

#include "engine/scene/scene.h"
#include "engine/simulator/simulation.h"

namespace viscera::test {

/// Two balls that a link ties; a grasper lifts one, a hook burns it, smoke rises into gas that
/// flows; one breathes and beats, and the table tilts.
SceneDescription busy_scene();

/// One model for all tests of a program, prepared without a cache.
const Model& busy_model();

}  // namespace viscera::test
