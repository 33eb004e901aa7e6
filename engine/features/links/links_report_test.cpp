#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/links/links.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;

/// A ball that hangs on the ground by its side, and a jaw that lifts its pole.
SceneDescription tied_ball() {
  SceneDescription scene = soft_ball_scene(6e-3, 4e-3);
  LinkDescription link;
  link.name = "band";
  link.between = {scene.organs[0].name, LinkDescription::kGround};
  link.region = ball_region(Vec3(kRadius, 0, 0), 8e-3);
  link.stiffness = 300.0;
  scene.extras.set(LinkDescriptions{link});
  scene.instruments = {straight_tool("jaw", InstrumentKind::kGrasper, 2e-3,
                                     {{0.0, Vec3(0, 0, kRadius + 4e-3), 0.0, 1.0},
                                      {0.1, Vec3(0, 0, kRadius + 1e-3), 0.0, 0.0},
                                      {0.3, Vec3(0, 0, kRadius + 5e-3), 0.0, 0.0}})};
  return scene;
}

TEST(LinksReport, TellsEachLinksEndsSpringsAndGreatestForce) {
  const SceneDescription scene = tied_ball();
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  const std::vector<LinkFigures> figures = link_figures(*world);
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_GT(figures[0].springs, 0u);
  EXPECT_EQ(figures[0].greatest_force, world->all<LinkState>()[0].greatest_force);
  EXPECT_GT(figures[0].greatest_force, 0.0);
  const std::vector<ReportSection> sections = links_report(*world);
  ASSERT_EQ(sections.size(), 1u);
  EXPECT_EQ(sections[0].key, "links");
  const Json expected = {{"name", "band"},
                         {"between", {scene.organs[0].name, "ground"}},
                         {"stiffness_N_per_m", 300.0},
                         {"springs", figures[0].springs},
                         {"greatest_force_N", figures[0].greatest_force}};
  EXPECT_EQ(Json::parse(sections[0].json), Json::array({expected}));
}

TEST(LinksReport, IsAnEmptyListWithoutLinks) {
  const auto world = build(soft_ball_scene(6e-3, 4e-3));
  ASSERT_TRUE(world);
  EXPECT_EQ(links_report(*world).front().json, "[]");
}

}  // namespace
}  // namespace viscera::test
