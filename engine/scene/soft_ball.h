// The small body that benchmarks and tests share.
#pragma once

#include "engine/scene/scene.h"

namespace viscera {

/// A scene of 2 s with one ball of 25 mm radius, centre at the origin, tissue "rubber", held below
/// z = -15 mm; nodes `spacing` apart, `finest` where instruments reach [m].
SceneDescription soft_ball_scene(double spacing, double finest);

}  // namespace viscera
