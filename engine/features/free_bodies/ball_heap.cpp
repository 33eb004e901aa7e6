#include "engine/features/free_bodies/ball_heap.h"

#include <fmt/format.h>

#include "engine/features/free_bodies/rubber_organs.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {
namespace {

constexpr double kRadius = 10e-3, kAir = 0.2e-3, kThick = 20e-3;
/// How far every other layer is shifted [m].
constexpr double kAside = 0.25 * kRadius;

}  // namespace

SceneDescription ball_heap(const BallHeap& options) {
  SceneDescription scene;
  scene.file = scene.name = "ball_heap";
  scene.duration = 10.0;
  RecipeGeometry ball;
  ball.recipe = "sphere";
  ball.radius = kRadius;
  ball.edge = 3e-3;
  const double pitch = 2.0 * kRadius + kAir;
  for (int layer = 0; layer < options.layers; ++layer)
    for (int row = 0; row < options.across; ++row)
      for (int column = 0; column < options.along; ++column) {
        const double aside = layer % 2 == 0 ? -kAside : kAside;
        const Vec3 at((column - 0.5 * (options.along - 1)) * pitch + aside,
                      (row - 0.5 * (options.across - 1)) * pitch + aside,
                      kRadius + kAir + layer * pitch);
        scene.organs.push_back(free_rubber(fmt::format("ball_{}_{}_{}", layer, row, column), ball,
                                           at, options.spacing));
      }
  const double x = 0.5 * options.along * pitch + kAside, y = 0.5 * options.across * pitch + kAside;
  const double high = options.layers * pitch;
  scene.organs.push_back(
      still_block("floor", {-x - kThick, -y - kThick, -kThick}, {x + kThick, y + kThick, 0.0}));
  scene.organs.push_back(
      still_block("left", {-x - kThick, -y - kThick, 0.0}, {-x, y + kThick, high}));
  scene.organs.push_back(
      still_block("right", {x, -y - kThick, 0.0}, {x + kThick, y + kThick, high}));
  scene.organs.push_back(still_block("front", {-x, -y - kThick, 0.0}, {x, -y, high}));
  scene.organs.push_back(still_block("back", {-x, y, 0.0}, {x, y + kThick, high}));
  scene.extras.set(TouchingDescription{.organs = true, .friction = options.friction});
  scene.extras.set(GravityDescription{});
  return scene;
}

}  // namespace viscera
