// Soft balls that fall into a box and come to rest on each other: for tests and benchmarks.
#pragma once

#include "engine/scene/scene.h"

namespace viscera {

struct BallHeap {
  int along = 2, across = 2, layers = 2;  ///< balls
  double friction = 0.2;                  ///< coefficient between them, and with the box
  double spacing = 6e-3;                  ///< of their nodes [m]
};

/// Balls of 10 mm and tissue "rubber", .2 mm apart, each layer a quarter of a ball aside of the one
/// below; the box leaves room for just that.
SceneDescription ball_heap(const BallHeap& options);

}  // namespace viscera
