#include "tests/support/small_world.h"

#include <gtest/gtest.h>

#include <ostream>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"

namespace viscera {

void PrintTo(const FlagSet& flags, std::ostream* out) {
  *out << '{';
  for (const FrameFlag& flag : flags) *out << ' ' << flag.name;
  *out << " }";
}

}  // namespace viscera

namespace viscera::test {

InstrumentDescription straight_tool(const std::string& name, InstrumentKind kind, double radius,
                                    std::vector<InstrumentKey> keys) {
  InstrumentDescription tool;
  tool.name = name;
  tool.kind = kind;
  tool.tip.radius = radius;
  tool.trocar = keys.front().tip + Vec3(0.0, 0.0, 0.2);
  tool.path = std::move(keys);
  return tool;
}

RecipeGeometry block_geometry(const Vec3& size, double edge) {
  RecipeGeometry block;
  block.recipe = "block";
  block.size = size;
  block.edge = edge;
  return block;
}

SceneDescription held_bar_scene(const Vec3& size, double edge, double held, double spacing,
                                double finest) {
  SceneDescription scene = soft_ball_scene(spacing, finest);
  OrganDescription& bar = scene.organs[0];
  bar.name = "bar";
  bar.geometry = block_geometry(size, edge);
  Region left;
  left.a = Vec3(-0.5 * size.x() + held, 0, 0);
  left.b = Vec3::UnitX();
  bar.fixed = {left};
  return scene;
}

Region ball_region(const Vec3& centre, double radius) {
  Region ball;
  ball.shape = Region::Shape::kSphere;
  ball.a = centre;
  ball.radius = radius;
  return ball;
}

std::map<std::string, Tissue> test_tissues() {
  Tissue rubber;
  rubber.name = "rubber";
  rubber.elastic = {10e3, 0.45};
  rubber.fracture_energy = 150.0;
  rubber.thermal.emplace();
  return {{"rubber", rubber}};
}

std::unique_ptr<World> build(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  if (!world) {
    ADD_FAILURE() << world.error().text();
    return nullptr;
  }
  return std::move(*world);
}

Model build_shared(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  auto made =
      build_model(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  EXPECT_TRUE(made) << made.error().text();
  return Model(*made);
}

FlagSet step_until(World& world, double time) {
  Trace trace(stage_names());
  FlagSet flags;
  while (world.time() < time - 1e-9) flags.raise(step_frame(world, trace).flags);
  return flags;
}

FlagSet but_for_strain(const FlagSet& flags) {
  FlagSet others;
  for (const FrameFlag& flag : flags)
    if (flag.name != kBeyondLinear.name) others.raise(flag);
  return others;
}

Vec3 force_on(const World& world, std::size_t instrument) {
  return world.all<InstrumentContact>()[instrument].force;
}

}  // namespace viscera::test
