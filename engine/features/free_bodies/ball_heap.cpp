#include "engine/features/free_bodies/ball_heap.h"

#include <fmt/format.h>

#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {
namespace {

constexpr double kRadius = 10e-3, kAir = 0.2e-3, kThick = 20e-3;
/// How far every other layer is shifted [m].
constexpr double kAside = 0.25 * kRadius;

OrganDescription block(const std::string& name, const Vec3& from, const Vec3& to) {
  OrganDescription organ;
  organ.name = name;
  RecipeGeometry geometry;
  geometry.recipe = "block";
  geometry.size = to - from;
  geometry.edge = 20e-3;
  organ.geometry = geometry;
  organ.tissue = "rubber";
  organ.pose.position = 0.5 * (from + to);
  organ.deformable = false;
  return organ;
}

OrganDescription ball(const std::string& name, const Vec3& at, double spacing) {
  OrganDescription organ;
  organ.name = name;
  RecipeGeometry geometry;
  geometry.recipe = "sphere";
  geometry.radius = kRadius;
  geometry.edge = 3e-3;
  organ.geometry = geometry;
  organ.tissue = "rubber";
  organ.pose.position = at;
  organ.resolution.spacing = organ.resolution.finest = spacing;
  organ.free = true;
  return organ;
}

}  // namespace

SceneDescription ball_heap(const BallHeap& options) {
  SceneDescription scene;
  scene.file = scene.name = "ball_heap";
  scene.duration = 10.0;
  const double pitch = 2.0 * kRadius + kAir;
  for (int layer = 0; layer < options.layers; ++layer)
    for (int row = 0; row < options.across; ++row)
      for (int column = 0; column < options.along; ++column) {
        const double aside = layer % 2 == 0 ? -kAside : kAside;
        const Vec3 at((column - 0.5 * (options.along - 1)) * pitch + aside,
                      (row - 0.5 * (options.across - 1)) * pitch + aside,
                      kRadius + kAir + layer * pitch);
        scene.organs.push_back(
            ball(fmt::format("ball_{}_{}_{}", layer, row, column), at, options.spacing));
      }
  const double x = 0.5 * options.along * pitch + kAside, y = 0.5 * options.across * pitch + kAside;
  const double high = options.layers * pitch;
  scene.organs.push_back(
      block("floor", {-x - kThick, -y - kThick, -kThick}, {x + kThick, y + kThick, 0.0}));
  scene.organs.push_back(block("left", {-x - kThick, -y - kThick, 0.0}, {-x, y + kThick, high}));
  scene.organs.push_back(block("right", {x, -y - kThick, 0.0}, {x + kThick, y + kThick, high}));
  scene.organs.push_back(block("front", {-x, -y - kThick, 0.0}, {x, -y, high}));
  scene.organs.push_back(block("back", {-x, y, 0.0}, {x, y + kThick, high}));
  scene.extras.set(TouchingDescription{.organs = true, .friction = options.friction});
  scene.extras.set(GravityDescription{});
  return scene;
}

}  // namespace viscera
