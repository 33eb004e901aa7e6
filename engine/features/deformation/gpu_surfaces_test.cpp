// The deform stage on the GPU beside the CPU's: the same scenes, stepped by both.
#include "engine/features/deformation/gpu_surfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/features/deformation/deformation.h"
#include "engine/gpu/backend.h"
#include "engine/run/view.h"
#include "engine/simulation/frame.h"
#include "engine/simulator/build.h"
#include "kernels/contact/deformation.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]

/// A probe that sinks into the ball beside a grasper that lifts it, and lets go at the end.
SceneDescription pressed_and_lifted() {
  auto scene = soft_ball_scene(7e-3, 4e-3);
  const auto key = [](double time, double x, double height, double jaw) {
    return InstrumentKey{time, Vec3(x, 0, kTop + height), 0.0, jaw};
  };
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, 3e-3,
                                     {key(0.0, 8e-3, 4e-3, 1.0), key(0.3, 8e-3, -1e-3, 1.0),
                                      key(0.5, 10e-3, -1e-3, 1.0), key(0.8, 10e-3, 20e-3, 1.0)}),
                       straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                     {key(0.0, -5e-3, 3e-3, 1.0), key(0.1, -5e-3, 1e-3, 1.0),
                                      key(0.2, -5e-3, 1e-3, 0.0), key(0.5, -5e-3, 4e-3, 0.0),
                                      key(0.6, -5e-3, 4e-3, 1.0), key(0.8, -5e-3, 20e-3, 1.0)})};
  scene.instruments[0].friction = 0.3;
  return scene;
}

double end_of(std::uint64_t frame) {
  return 1e-3 * static_cast<double>(StepRate().last_tick(frame));
}

class GpuSurfacesTest : public testing::Test {
 protected:
  void SetUp() override {
    auto device = open_compute_device(Backend::kGpu, false);
    if (!device) GTEST_SKIP() << device.error().text();
    context_ = device->context;
  }

  std::shared_ptr<GpuSurfaces> surfaces_of(World& world) {
    auto made = GpuSurfaces::create(context_, world);
    EXPECT_TRUE(made) << made.error().text();
    return made ? *made : nullptr;
  }

  std::shared_ptr<EglContext> context_;
};

TEST_F(GpuSurfacesTest, ForcesAndSurfacesAreTheCpusButForRounding) {
  const auto scene = pressed_and_lifted();
  auto cpu = build(scene), gpu = build(scene);
  ASSERT_TRUE(cpu && gpu);
  gpu->all<GpuOrgans>().add(kWhole, {surfaces_of(*gpu)});
  ASSERT_TRUE(gpu->one<GpuOrgans>()->surfaces);
  EXPECT_EQ(gpu->one<GpuOrgans>()->surfaces->organs(), 1u);
  const auto greatest_force = [](const World& world) {
    return std::max(force_on(world, 0).norm(), force_on(world, 1).norm());
  };
  double scale = 0.0, force_apart = 0.0, apart = 0.0;
  for (std::uint64_t frame = 1; frame <= 36; ++frame) {
    const FlagSet flags = step_until(*cpu, end_of(frame));
    EXPECT_EQ(step_until(*gpu, end_of(frame)), flags) << frame;
    scale = std::max(scale, greatest_force(*cpu));
    for (std::size_t i = 0; i < 2; ++i)
      force_apart = std::max(force_apart, (force_on(*cpu, i) - force_on(*gpu, i)).norm());
    const OrganState &a = cpu->all<OrganState>()[0], &b = gpu->all<OrganState>()[0];
    ASSERT_EQ(a.deformed, b.deformed) << frame;
    EXPECT_EQ(b.on_gpu, b.deformed) << frame;
    for (std::size_t v = 0; v < a.positions.size(); ++v)
      apart = std::max<double>(apart, (a.positions[v] - b.positions[v]).norm());
  }
  RecordProperty("force_apart", std::to_string(force_apart / scale));
  RecordProperty("positions_apart_m", std::to_string(1e9 * apart) + "e-9");
  EXPECT_GT(scale, 0.05);
  // Contact of a frame stands on the surface of the last one: roundings of single precision, 6e-8
  // of some centimetres, pass into depths of millimetres.
  EXPECT_LT(force_apart, 1e-5 * scale);
  EXPECT_LT(apart, 1e-7);
}

TEST_F(GpuSurfacesTest, NormalsStayOnTheGpuAndAreThoseOfTheDeformedTriangles) {
  auto world = build(pressed_and_lifted());
  ASSERT_TRUE(world);
  world->all<GpuOrgans>().add(kWhole, {surfaces_of(*world)});
  ASSERT_TRUE(world->one<GpuOrgans>()->surfaces);
  step_until(*world, 0.4);
  const Entity organ = world->all<OrganBody>().owner(0);
  const OrganState& state = world->all<OrganState>()[0];
  ASSERT_TRUE(state.on_gpu);
  const DeviceSurface device = world->one<GpuOrgans>()->surfaces->surface(organ);
  ASSERT_NE(device.normals, nullptr);
  const std::size_t count = state.positions.size();
  const auto normals = device.normals->download<Vec3f>(device.first_vertex * sizeof(Vec3f), count);
  EXPECT_EQ(device.positions->download<Vec3f>(device.first_vertex * sizeof(Vec3f), count),
            state.positions);
  std::vector<Vec3f> expected;
  deformed_normals(world->all<OrganBody>()[0].model->drawn, state.positions, expected);
  for (std::size_t v = 0; v < count; ++v) ASSERT_LT((normals[v] - expected[v]).norm(), 1e-4f) << v;

  auto scene = pressed_and_lifted();
  CameraDescription camera;
  camera.path = {CameraKey{}};
  camera.path[0].tip = Vec3(0, -0.1, 0);
  scene.camera = camera;
  const Endoscope endoscope(camera);
  Shown shown;
  EXPECT_EQ(make_view(*world, shown, scene, endoscope, 0).organs[0].device.normals, device.normals);
  step_until(*world, 0.8);
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
  EXPECT_FALSE(world->all<OrganState>()[0].on_gpu);
  EXPECT_EQ(make_view(*world, shown, scene, endoscope, 0).organs[0].device.positions, nullptr)
      << "an organ at rest is drawn from the shape at rest";
}

TEST_F(GpuSurfacesTest, PassesAreTimedInFramesThatDeformAndInNoOthers) {
  auto world = build(pressed_and_lifted());
  ASSERT_TRUE(world);
  world->all<GpuOrgans>().add(kWhole, {surfaces_of(*world)});
  ASSERT_TRUE(world->one<GpuOrgans>()->surfaces);
  std::size_t deformed = 0;
  std::uint64_t version = 0;
  for (std::uint64_t frame = 1; frame <= 48; ++frame) {
    step_until(*world, end_of(frame));
    const OrganState& state = world->all<OrganState>()[0];
    deformed += state.deformed && state.version != version ? 1 : 0;
    version = state.version;
  }
  ASSERT_GT(deformed, 10u);
  std::vector<std::string> names;
  for (const GpuSurfaces::Pass& pass : world->one<GpuOrgans>()->surfaces->passes()) {
    names.push_back(pass.name);
    EXPECT_EQ(pass.seconds.size(), deformed) << pass.name;
    for (const double seconds : pass.seconds) EXPECT_GE(seconds, 0.0);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"upload", "product", "carry", "near", "normals",
                                             "read back"}));
}

TEST_F(GpuSurfacesTest, ABrokenValueFreezesTheOrganInItsLastShapeWithoutForce) {
  auto world = build(pressed_and_lifted());
  ASSERT_TRUE(world);
  world->all<GpuOrgans>().add(kWhole, {surfaces_of(*world)});
  ASSERT_TRUE(world->one<GpuOrgans>()->surfaces);
  step_until(*world, 0.4);
  const std::vector<Vec3f> last = world->all<OrganState>()[0].positions;
  // The same organ with a rest shape that no number describes any more.
  const auto other = build(pressed_and_lifted());
  ASSERT_TRUE(other);
  auto& broken = const_cast<OrganModel&>(*other->all<OrganBody>()[0].model);
  broken.surface.vertices[3].x() = std::numeric_limits<double>::quiet_NaN();
  world->one<GpuOrgans>()->surfaces = surfaces_of(*other);
  const FlagSet flags = step_until(*world, 0.45);
  EXPECT_TRUE(flags.has(kOrganFrozen));
  const OrganState& state = world->all<OrganState>()[0];
  EXPECT_TRUE(state.frozen);
  EXPECT_FALSE(state.on_gpu);
  EXPECT_EQ(state.positions, last);
  std::vector<Vec3f> normals;
  deformed_normals(world->all<OrganBody>()[0].model->drawn, last, normals);
  EXPECT_TRUE(std::ranges::equal(ShownNormals().of(*world, 0), normals));
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_EQ(force_on(*world, 1), Vec3::Zero());
}

TEST_F(GpuSurfacesTest, AfterALostContextTheOrgansAreTheCpusWithoutAFrameLost) {
  const auto scene = pressed_and_lifted();
  auto cpu = build(scene), gpu = build(scene);
  ASSERT_TRUE(cpu && gpu);
  gpu->all<GpuOrgans>().add(kWhole, {surfaces_of(*gpu)});
  ASSERT_TRUE(gpu->one<GpuOrgans>()->surfaces);
  double scale = 0.0;
  for (std::uint64_t frame = 1; frame <= 36; ++frame) {
    if (frame == 18) context_->declare_lost();
    const FlagSet flags = step_until(*cpu, end_of(frame));
    EXPECT_EQ(step_until(*gpu, end_of(frame)), flags) << frame;
    const OrganState &a = cpu->all<OrganState>()[0], &b = gpu->all<OrganState>()[0];
    ASSERT_FALSE(b.frozen) << frame;
    ASSERT_EQ(b.on_gpu, frame < 18 && b.deformed) << frame;
    ASSERT_EQ(a.deformed, b.deformed) << frame;
    scale = std::max(scale, a.greatest_displacement);
    double apart = 0.0;
    for (std::size_t v = 0; v < a.positions.size(); ++v)
      apart = std::max<double>(apart, (a.positions[v] - b.positions[v]).norm());
    ASSERT_LT(apart, 1e-4 * scale + 1e-9) << frame;
    if (frame < 18 || !a.deformed) continue;
    double turned = 0.0;
    for (std::size_t v = 0; v < a.normals.size(); ++v)
      turned = std::max<double>(turned, (a.normals[v] - b.normals[v]).norm());
    ASSERT_LT(turned, 1e-3) << frame;
  }
  EXPECT_EQ(gpu->one<GpuOrgans>()->surfaces->trouble(), "organs on the GPU: its context was lost");
  EXPECT_FALSE(gpu->one<GpuOrgans>()->surfaces->holds(gpu->all<OrganContact>().owner(0)));
}

TEST_F(GpuSurfacesTest, ALossThatSomebodyElseFindsBringsShapesHome) {
  auto world = build(pressed_and_lifted());
  ASSERT_TRUE(world);
  world->all<GpuOrgans>().add(kWhole, {surfaces_of(*world)});
  ASSERT_TRUE(world->one<GpuOrgans>()->surfaces);
  step_until(*world, 0.4);
  OrganState& state = world->all<OrganState>()[0];
  ASSERT_TRUE(state.on_gpu);
  leave_gpu(*world, "its context was lost");
  EXPECT_FALSE(state.on_gpu);
  std::vector<Vec3f> normals;
  deformed_normals(world->all<OrganBody>()[0].model->drawn, state.positions, normals);
  EXPECT_TRUE(std::ranges::equal(ShownNormals().of(*world, 0), normals));
  step_until(*world, 0.9);
  EXPECT_FALSE(state.frozen);
  EXPECT_FALSE(state.deformed) << "the tools have let go";
}

TEST_F(GpuSurfacesTest, OrgansThatNothingTouchesNeedNone) {
  auto scene = soft_ball_scene(8e-3, 8e-3);
  auto world = build(scene);
  ASSERT_TRUE(world);
  auto made = GpuSurfaces::create(context_, *world);
  ASSERT_TRUE(made);
  EXPECT_EQ(*made, nullptr);
}

TEST_F(GpuSurfacesTest, OrgansThatHivesAnswerForStayOnTheCpuBesideOthers) {
  auto scene = pressed_and_lifted();
  scene.organs.push_back(scene.organs[0]);
  scene.organs[1].name = "local";
  scene.organs[1].response = Response::kLocal;
  scene.organs[1].pose.position.x() = 0.2;
  auto world = build(scene);
  ASSERT_TRUE(world);
  ASSERT_EQ(world->all<OrganContact>().size(), 2u);
  const auto surfaces = surfaces_of(*world);
  ASSERT_TRUE(surfaces);
  EXPECT_TRUE(surfaces->holds(world->all<OrganBody>().owner(0)));
  EXPECT_FALSE(surfaces->holds(world->all<OrganBody>().owner(1)));
}

}  // namespace
}  // namespace viscera::test
