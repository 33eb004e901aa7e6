// A held ball over the kidney of the palpation scene: what the hand feels must not know where
// facets, nodes and hives are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/features/features.h"
#include "engine/features/local/hive_settings.h"
#include "engine/organ/shape.h"
#include "engine/scene/load_scene.h"
#include "engine/scene/tissues.h"
#include "engine/simulator/build.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 4e-3;  // of the scene's probe [m]
constexpr double kDepth = 2e-3;
constexpr double kHalfLength = 10e-3;  // of the slide [m]
constexpr double kStep = 1e-4;         // a tick at 0.1 m/s

/// A smooth path close to the kidney's upper face: a parabola through where it is met from above.
/// The path's depth may wander with the kidney's shape, but never from facet to facet.
class Slide {
 public:
  explicit Slide(const TriangleSurface& surface) {
    const SurfaceTree tree(surface);
    const Box box = bounds(surface);
    constexpr int kPlaces = 41;
    MatrixX basis(kPlaces, 3);
    VectorX heights(kPlaces);
    for (int i = 0; i < kPlaces; ++i) {
      const double y = -kHalfLength + 2.0 * kHalfLength * i / (kPlaces - 1);
      basis.row(i) << 1.0, y, y * y;
      heights[i] = height(tree, Vec3(kX, y, 0.0), box.max().z());
    }
    fit_ = basis.colPivHouseholderQr().solve(heights);
    off_ = (basis * fit_ - heights).cwiseAbs().maxCoeff();
  }
  /// Ball's centre, pressed this deep.
  Vec3 tip(double y, double depth) const {
    return {kX, y, fit_[0] + fit_[1] * y + fit_[2] * y * y + kRadius - depth};
  }
  double off() const { return off_; }

 private:
  static constexpr double kX = 6e-3;
  /// Where a plumb line meets the surface from above, by halving on the signed distance.
  static double height(const SurfaceTree& tree, Vec3 at, double top) {
    double in = 0.0, out = top + 1e-3;
    for (int i = 0; i < 40; ++i) {
      at.z() = 0.5 * (in + out);
      (tree.signed_distance(at) < 0.0 ? in : out) = at.z();
    }
    return at.z();
  }
  Eigen::Vector3d fit_;
  double off_ = 0.0;
};

struct Kidney {
  SceneDescription scene;
  std::unique_ptr<World> world;
  std::unique_ptr<Slide> slide;
  std::unique_ptr<HiveTissue> tissue;
  std::unique_ptr<WalkableSurface> surface;
  Vec3 last = Vec3::Zero();
  std::uint64_t tick = 0;

  TactileForce at(const Vec3& tip) {
    ToolMotion motion;
    motion.pose.position = tip;
    motion.velocity = (tip - last) / 1e-3;
    motion.tick = tick++;
    last = tip;
    return tissue->respond(motion, 1e-3);
  }
};

/// The scene's kidney, its probe led along the slide, and the probe's tissue as the scene has it.
std::unique_ptr<Kidney> kidney(const std::string& model = "linear") {
  auto all = std::make_unique<Kidney>();
  SceneLoadOptions options;
  // What a hand adds to a linear body.
  options.overrides = {{"organs/kidney/material/model", '"' + model + '"'},
                       {"organs/kidney/response", "\"linear\""}};
  options.assets = project_file("assets");
  options.features = feature_keys();
  auto scene = load_scene(project_file("scenes/kidney_palpation.json"), options);
  if (!scene) {
    ADD_FAILURE() << scene.error().text();
    return nullptr;
  }
  all->scene = std::move(*scene);
  const auto shape = build_shape(all->scene.organs[0].geometry, options.assets);
  if (!shape) {
    ADD_FAILURE() << shape.error().text();
    return nullptr;
  }
  all->slide = std::make_unique<Slide>(*shape);
  std::vector<InstrumentKey>& path = all->scene.instruments[0].path;
  path = {{0.0, all->slide->tip(-kHalfLength, -3e-3), 0.0, 1.0},
          {0.5, all->slide->tip(-kHalfLength, kDepth), 0.0, 1.0},
          {1.0, all->slide->tip(0.0, kDepth), 0.0, 1.0},
          {1.5, all->slide->tip(kHalfLength, kDepth), 0.0, 1.0}};
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  if (!tissues) {
    ADD_FAILURE() << tissues.error().text();
    return nullptr;
  }
  std::vector<std::string> warnings;
  auto world = build_world(all->scene, *tissues, {options.assets, false}, no_progress(), warnings);
  if (!world) {
    ADD_FAILURE() << world.error().text();
    return nullptr;
  }
  all->world = std::move(*world);
  const OrganBody& organ = all->world->all<OrganBody>()[0];
  auto surface = WalkableSurface::make(organ.model->surface);
  auto settings = hive_settings(all->scene.instruments[0], organ, HiveBuilding::kInLockstep);
  if (!surface || !settings) {
    ADD_FAILURE() << (surface ? settings.error().text() : surface.error().text());
    return nullptr;
  }
  all->surface = std::make_unique<WalkableSurface>(std::move(*surface));
  EXPECT_EQ(settings->hive.periphery, HivePeriphery::kCoupled);
  auto tissue = HiveTissue::create(
      {all->surface.get(), &organ.model->compliance, &organ.model->touchable}, *settings);
  if (!tissue) {
    ADD_FAILURE() << tissue.error().text();
    return nullptr;
  }
  all->tissue = std::move(*tissue);
  TissueSnapshot& told = all->tissue->snapshots().back();
  const Pose& pose = all->world->all<OrganPose>()[0].pose;
  told.pose = pose;
  told.nearest = all->surface->nearest(pose.to_local(path[1].tip)).point;
  all->tissue->snapshots().publish();
  return all;
}

class TouchSliding : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, TouchSliding, testing::Values("linear", "neo_hookean"),
                         [](const auto& given) { return std::string(given.param); });

TEST_P(TouchSliding, OverTheKidneyNoTenthOfAMillimetreChangesTheForceByAPercent) {
  const auto all = kidney(GetParam());
  ASSERT_TRUE(all);
  ASSERT_LT(all->slide->off(), 1.5e-3);
  for (int i = 0; i <= 100; ++i)
    all->at(all->slide->tip(-kHalfLength, -3e-3 + (kDepth + 3e-3) * i / 100));
  Vec3 before = all->at(all->slide->tip(-kHalfLength, kDepth)).force;
  double worst = 0.0, least = before.norm(), most = least;
  for (double y = -kHalfLength; y <= kHalfLength; y += kStep) {
    const TactileForce felt = all->at(all->slide->tip(y, kDepth));
    worst = std::max(worst, (felt.force - before).norm() / felt.force.norm());
    before = felt.force;
    least = std::min(least, before.norm());
    most = std::max(most, before.norm());
  }
  std::printf("force %.4f to %.4f N, greatest change in 0.1 mm %.2f %%, %d hives\n", least, most,
              100 * worst, static_cast<int>(all->tissue->figures().hives));
  EXPECT_GT(least, 0.02);
  EXPECT_LT(worst, 0.01);
  EXPECT_GE(all->tissue->figures().hives, 2u);
  EXPECT_EQ(all->tissue->figures().refused, 0u);
  EXPECT_EQ(all->tissue->figures().uncovered, 0u);
}

TEST_P(TouchSliding, RoundsOverTheKidneyGiveBackNoEnergy) {
  const auto all = kidney(GetParam());
  ASSERT_TRUE(all);
  const Slide& slide = *all->slide;
  constexpr double kAir = -1e-3;
  double y = -kHalfLength, depth = kAir, given = 0.0, stored = 0.0;
  for (int i = 0; i < 60; ++i) all->at(slide.tip(y, -4e-3 + i * 5e-5));
  Vec3 before = slide.tip(y, depth), force = all->at(before).force;
  const auto go = [&](double to_y, double to_depth, int steps) {
    const double from_y = y, from_depth = depth;
    for (int i = 1; i <= steps; ++i) {
      y = from_y + (to_y - from_y) * i / steps;
      depth = from_depth + (to_depth - from_depth) * i / steps;
      const Vec3 now = slide.tip(y, depth);
      const TactileForce felt = all->at(now);
      given += 0.5 * (force + felt.force).dot(now - before);
      stored = std::max(stored, felt.energy);
      force = felt.force;
      before = now;
    }
  };
  // Down here, over there pressed, up; and back the other way round, which would take what the
  // first gave.
  for (const double from : {-kHalfLength, kHalfLength}) {
    go(from, kAir, 300);
    given = 0.0;
    for (int round = 0; round < 3; ++round) {
      go(from, 3e-3, 400);
      go(-from, 3e-3, 600);
      go(-from, kAir, 400);
      go(from, kAir, 300);
    }
    std::printf("given back %+.4f of the most that was stored\n", given / stored);
    EXPECT_GT(stored, 1e-5);
    EXPECT_LT(std::abs(given), 0.01 * stored);
  }
}

// The frame's own contact has the same tissue, tool and compliance, at 60 Hz and with as many cells
// laid in another way. Were the hand's fewer, 19, it would feel 5 % more.
TEST(TouchBesideTheFrame, TheHandFeelsTheForceOfTheGlobalModelAllAlong) {
  const auto all = kidney();
  ASSERT_TRUE(all);
  for (int i = 0; i <= 100; ++i)
    all->at(all->slide->tip(-kHalfLength, -3e-3 + (kDepth + 3e-3) * i / 100));
  double worst = 0.0;
  int compared = 0;
  while (all->world->time() < 1.45) {
    step_until(*all->world, all->world->time() + 1.0 / 60.0);
    const Vec3 tip = all->world->all<InstrumentState>()[0].tip;
    if (all->world->time() < 0.5) continue;
    // Several ticks at the place, so that the newest hive carries all of the force.
    TactileForce felt;
    const Vec3 from = all->last;
    for (int i = 1; i <= 40; ++i) felt = all->at(from + (tip - from) * std::min(1.0, i / 17.0));
    const Vec3 frame = force_on(*all->world, 0);
    worst = std::max(worst, (felt.force - frame).norm() / frame.norm());
    ++compared;
  }
  std::printf("greatest difference %.2f %% over %d frames\n", 100 * worst, compared);
  EXPECT_GT(compared, 30);
  EXPECT_LT(worst, 0.02);
}

}  // namespace
}  // namespace viscera::test
