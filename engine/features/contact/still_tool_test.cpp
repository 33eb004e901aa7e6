// What a tool does to tissue under which it stands still.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <vector>

#include "engine/simulation/controls.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

// Where it lies so deep beside an edge that tissue gives way on either side, cells that lie a
// little to one side carry the tissue farther to the other: it was pushed to and fro by four fifths
// of its force from frame to frame.
TEST(StillTool, DeepBesideAnEdgeIsPushedSteadily) {
  auto scene = soft_ball_scene(6.45e-3, 5.19e-3);
  OrganDescription& block = scene.organs[0];
  block.geometry = block_geometry(Vec3(20.3e-3, 21.4e-3, 37.9e-3), 2.74e-3);
  block.fixed[0].a = Vec3(0, 0, -9.46e-3);
  block.response = Response::kFinite;
  block.youngs_modulus = 6e3;
  const auto about = [](double degrees, const Vec3& axis) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis);
  };
  block.pose.orientation =
      about(20.6, Vec3::UnitZ()) * about(-16.2, Vec3::UnitY()) * about(-10.7, Vec3::UnitX());
  auto hook = straight_tool("hook", InstrumentKind::kHook, 1.18e-3,
                            {{0.0, {-22.8e-3, -1.75e-3, 27.5e-3}, 0.0, 1.0},
                             {0.053, {-17.97e-3, -1.56e-3, 22.2e-3}, 0.0, 1.0},
                             {0.107, {-14.45e-3, 0.46e-3, 17.5e-3}, 0.0, 1.0},
                             {0.16, {-9.76e-3, -2.83e-3, 11.7e-3}, 0.0, 1.0},
                             {0.213, {-7.89e-3, -3.07e-3, 11.6e-3}, 0.0, 1.0},
                             {0.267, {-6.2e-3, -0.68e-3, 11.0e-3}, 0.0, 1.0}});
  hook.tip.shape = TipDescription::Shape::kCapsule;
  hook.tip.length = 2.77e-3;
  hook.trocar = Vec3(47.3e-3, -15.2e-3, 0.15);
  scene.instruments.push_back(hook);
  const auto world = build(scene);
  ASSERT_TRUE(world);
  std::vector<Vec3> forces;
  for (int frame = 0; frame < 110; ++frame) {
    step_frame(*world, controls_of_paths(*world, static_cast<double>(frame + 1) / 60.0), nullptr);
    if (frame >= 80) forces.push_back(force_on(*world, 0));
  }
  double greatest = 0.0, change = 0.0;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    greatest = std::max(greatest, forces[i].norm());
    if (i > 0) change = std::max(change, (forces[i] - forces[i - 1]).norm());
  }
  EXPECT_GT(greatest, 0.1);
  EXPECT_LT(change, 0.2 * greatest) << greatest << " N";
}

}  // namespace
}  // namespace viscera::test
