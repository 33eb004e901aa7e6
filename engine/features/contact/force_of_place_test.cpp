// Contact without friction knows where its tools are, not how they came there; its cells push along
// the tool's own normals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/simulation/controls.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 3e-3;            // of the tips [m]
constexpr double kTop = 15e-3;              // of the block [m]
const Vec3 kBlock(60e-3, 60e-3, 2 * kTop);  // edges [m]

/// A block on its bottom and so many balls above it.
SceneDescription block_scene(std::size_t tools) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  OrganDescription& block = scene.organs[0];
  block.geometry = block_geometry(kBlock, 2e-3);
  block.fixed[0].a = Vec3(0, 0, -kTop + 1e-9);
  for (std::size_t i = 0; i < tools; ++i) {
    const Vec3 start(20e-3 * static_cast<double>(i), 0, kTop + kRadius + 3e-3);
    scene.instruments.push_back(
        straight_tool("tip" + std::to_string(i), InstrumentKind::kProbe, kRadius,
                      {{0.0, start, 0.0, 1.0}, {0.1, start - Vec3(0, 0, 6e-3), 0.0, 1.0}}));
  }
  return scene;
}

/// A ball's centre over the block, its lowest point so deep.
Vec3 pressed(double x, double y, double depth) {
  return {x, y, kTop + kRadius - depth};
}

struct Led {
  explicit Led(const SceneDescription& scene) : world(build(scene)) {
    if (world) controls = controls_of_paths(*world, 0.0);
  }
  /// A frame with the tools there.
  FlagSet step(const std::vector<Vec3>& tips) {
    for (std::size_t i = 0; i < tips.size(); ++i) controls.tools[i].tip = tips[i];
    return step_frame(*world, controls, nullptr).flags;
  }
  /// As step, until the tools have stood still for long.
  void settle(const std::vector<Vec3>& tips) {
    for (int frame = 0; frame < 30; ++frame) step(tips);
  }
  Vec3 force(std::size_t tool) const { return force_on(*world, tool); }

  std::unique_ptr<World> world;
  Controls controls;
};

double difference(const Vec3& one, const Vec3& other) {
  return (one - other).norm() / other.norm();
}

// How far the tissue leaves sideways from under a tool is known from the last frame: a force lags
// by what that changes within one. Once the tool stands still it is that of its place.
TEST(ForceOfPlace, OfOneToolIsTheSameHoweverItCameThere) {
  Led led(block_scene(1));
  ASSERT_TRUE(led.world);
  const Vec3 place = pressed(4e-3, -2e-3, 2e-3), air = pressed(4e-3, -2e-3, -3e-3);
  led.step({place});  // from the air within a frame
  const Vec3 at_once = led.force(0);
  led.settle({place});
  const Vec3 first = led.force(0);
  ASSERT_GT(first.z(), 0.01);
  EXPECT_LT(difference(at_once, first), 5e-3);
  const auto comes = [&](const char* from) {
    led.step({place});
    EXPECT_LT(difference(led.force(0), first), 5e-3) << "at once, " << from;
    led.settle({place});
    EXPECT_LT(difference(led.force(0), first), 1e-9) << from;
  };
  led.settle({pressed(4e-3, -2e-3, 4e-3)});
  comes("from deeper");
  for (int i = 8; i >= 1; --i) led.step({pressed(4e-3 - 1e-3 * i, -2e-3 + 0.5e-3 * i, 2.5e-3)});
  comes("from aside");
  led.step({air});
  for (int i = -2; i < 20; ++i) led.step({pressed(4e-3, -2e-3, 1e-4 * i)});
  comes("slowly from above");
}

// What others do to the tissue is known from the last frame, too.
TEST(ForceOfPlace, OfSeveralToolsIsTheSameOnceTheyStandStill) {
  Led led(block_scene(2));
  ASSERT_TRUE(led.world);
  const std::vector<Vec3> places{pressed(-4e-3, 0, 2e-3), pressed(4e-3, 1e-3, 1.5e-3)};
  led.step(places);
  const Vec3 at_once = led.force(0);
  led.settle(places);
  const Vec3 first = led.force(0), other = led.force(1);
  EXPECT_LT(difference(at_once, first), 0.02);
  for (int i = 8; i >= 0; --i)
    led.step({pressed(-4e-3 - 1e-3 * i, 0, 3e-3), pressed(4e-3, 1e-3 + 1e-3 * i, 1e-3)});
  led.settle(places);
  EXPECT_LT(difference(led.force(0), first), 1e-7);
  EXPECT_LT(difference(led.force(1), other), 1e-7);
}

/// Stored in the tissue [J].
double energy(const World& world) {
  const OrganContact& contact = world.all<OrganContact>()[0];
  const std::vector<Vec3>& moved = world.all<OrganTouch>()[0].solver->cell_displacements();
  double sum = 0.0;
  for (std::size_t k = 0; k < contact.cells.size(); ++k)
    sum += 0.5 * contact.solution.forces[k].dot(moved[k]);
  return sum;
}

// Two balls side by side: each stands on the wall of the other's dent, which pushes it towards the
// other, by what the energy falls by as it goes there.
TEST(ForceOfPlace, AWallOfADentPushesAsideByWhatTheEnergyFallsBy) {
  Led led(block_scene(2));
  ASSERT_TRUE(led.world);
  const double apart = 8e-3, depth = 1.5e-3, step = 0.8e-3;
  led.settle({pressed(-0.5 * apart, 0, depth), pressed(0.5 * apart, 0, depth)});
  const Vec3 force = led.force(0), other = led.force(1);
  const auto energy_at = [&](double x) {
    led.settle({pressed(x, 0, depth), pressed(0.5 * apart, 0, depth)});
    return energy(*led.world);
  };
  const double fall =
      (energy_at(-0.5 * apart - step) - energy_at(-0.5 * apart + step)) / (2 * step);
  RecordProperty("aside_over_up", std::to_string(force.x() / force.z()));
  RecordProperty("aside_over_the_energys_slope", std::to_string(force.x() / fall));
  EXPECT_GT(force.x(), 0.015 * force.z());
  EXPECT_NEAR(force.x() / fall, 1.0, 0.05);
  EXPECT_NEAR(-other.x() / force.x(), 1.0, 0.02);
}

// Near an edge tissue leaves sideways from under the tool. Cells that went with it, as if they were
// glued to the tool, would push the tool aside by five times what the energy falls by.
TEST(ForceOfPlace, NearAnEdgeTheForceAsideIsTheEnergysSlopeToo) {
  Led led(block_scene(1));
  ASSERT_TRUE(led.world);
  const double depth = 1e-3, step = 0.5e-3;
  // Nearest of all the direction that cells are sought along leans over the edge, and with it the
  // pattern.
  for (const auto& [off, bound] : {std::pair{14e-3, 1e-3}, std::pair{10e-3, 1e-3},
                                   std::pair{8e-3, 1e-3}, std::pair{6e-3, 8e-3}}) {
    const double x = 0.5 * kBlock.x() - off;
    const auto energy_at = [&](double at) {
      led.settle({pressed(at, 0, depth)});
      return energy(*led.world);
    };
    const double fall = (energy_at(x - step) - energy_at(x + step)) / (2 * step);
    led.settle({pressed(x, 0, depth)});
    const Vec3 force = led.force(0);
    RecordProperty("aside_over_up_at_" + std::to_string(1e3 * off),
                   std::to_string(force.x() / force.z()));
    RecordProperty("energys_slope_over_up_at_" + std::to_string(1e3 * off),
                   std::to_string(fall / force.z()));
    EXPECT_NEAR(force.x() / force.z(), fall / force.z(), bound) << off;
  }
}

TEST(ForceOfPlace, CellsPushAlongTheToolsOwnNormals) {
  Led led(block_scene(1));
  ASSERT_TRUE(led.world);
  const Vec3 tip = pressed(0, 0, 2e-3);
  led.step({tip});
  const OrganContact& contact = led.world->all<OrganContact>()[0];
  ASSERT_GT(contact.solution.touching, 10);
  double steepest = 0.0;
  for (std::size_t k = 0; k < contact.cells.size(); ++k) {
    const ContactCell& cell = contact.cells[k];
    // Where the cell's normal leads through the tissue the ball's surface is met.
    const Vec3 met = tip + kRadius * cell.direction;
    EXPECT_NEAR((met - cell.position).dot(cell.direction), cell.depth, 1e-9);
    if (contact.solution.forces[k].isZero(0.0)) continue;
    steepest = std::max(steepest, cell.direction.head<2>().norm());
    EXPECT_LT(contact.solution.forces[k].cross(cell.direction).norm(),
              1e-12 * contact.solution.forces[k].norm());
  }
  EXPECT_GT(steepest, 0.6);
  // By symmetry nothing is left aside but what nodes leave.
  EXPECT_LT(led.force(0).head<2>().norm(), 0.01 * led.force(0).z());
}

// A pattern as wide as the tool is deep needs no force to be sized by: where tissue gives way as a
// whole it is wider than its contact, and the force hardly minds.
TEST(ForceOfPlace, IsThatOfHertzFromTheFirstFrameOn) {
  Led led(block_scene(1));
  ASSERT_TRUE(led.world);
  const double modulus = 10e3 / (1.0 - 0.45 * 0.45);
  // Of the shallowest contacts few cells know.
  for (const auto& [depth, bound] : {std::pair{0.05e-3, 0.12}, std::pair{0.1e-3, 0.09},
                                     std::pair{0.2e-3, 0.05}, std::pair{0.4e-3, 0.05}}) {
    led.step({pressed(0, 0, -1e-3)});
    led.step({pressed(0, 0, depth)});
    const double hertz = 4.0 / 3.0 * modulus * std::sqrt(kRadius) * std::pow(depth, 1.5);
    // The ball's shape and its normals take 12 % of depth / radius, the block's base adds some.
    EXPECT_NEAR(led.force(0).z() / hertz, 1.0, bound) << depth;
  }
}

}  // namespace
}  // namespace viscera::test
