#include "engine/features/touching/edge_samples.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/free_bodies/block_on_floor.h"
#include "engine/features/touching/touching.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kHalf(15e-3, 10e-3, 6e-3);

TriangleSurface edged_box() {
  return box(2.0 * kHalf, 5);
}

EdgeSamples samples_of(const TriangleSurface& surface, double pitch) {
  return edge_samples(surface, sharp_edges(surface), pitch);
}

/// How many of a place's coordinates lie on faces of the box.
int faces_at(const Vec3& place) {
  int count = 0;
  for (int a = 0; a < 3; ++a) count += std::abs(std::abs(place[a]) - kHalf[a]) < 1e-9 ? 1 : 0;
  return count;
}

double nearest(const EdgeSamples& samples, const Vec3& place) {
  double least = 1.0;
  for (const SurfacePatch& sample : samples.places)
    least = std::min(least, (sample.position - place).norm());
  return least;
}

TEST(EdgeSamples, OfABoxLieAlongItsTwelveEdgesAndAtItsCorners) {
  const TriangleSurface surface = edged_box();
  for (const double pitch : {1e-3, 3e-3, 7e-3}) {
    const EdgeSamples samples = samples_of(surface, pitch);
    int corners = 0;
    for (const SurfacePatch& sample : samples.places) {
      EXPECT_GE(faces_at(sample.position), 2);
      EXPECT_LT((position(surface, sample.point) - sample.position).norm(), 1e-12);
      // As far from each face that it lies on, outward.
      const int faces = faces_at(sample.position);
      for (int a = 0; a < 3; ++a)
        EXPECT_NEAR(sample.normal[a] * (sample.position[a] < 0.0 ? -1.0 : 1.0),
                    std::abs(std::abs(sample.position[a]) - kHalf[a]) < 1e-9
                        ? 1.0 / std::sqrt(static_cast<double>(faces))
                        : 0.0,
                    1e-12);
      corners += faces_at(sample.position) == 3 ? 1 : 0;
    }
    EXPECT_EQ(corners, 8) << pitch;
    for (int axis = 0; axis < 3; ++axis)
      for (double share = -1.0; share <= 1.0; share += 0.02) {
        Vec3 place = kHalf;
        place[axis] *= share;
        EXPECT_LT(nearest(samples, place), pitch);
      }
    for (std::size_t i = 0; i < samples.places.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GT((samples.places[i].position - samples.places[j].position).norm(), 0.99 * pitch);
  }
}

TEST(EdgeSamples, AreNoneWhereASurfaceIsSmoothOrTurnsInward) {
  EXPECT_TRUE(sharp_edges(icosphere(25e-3, 2)).empty());
  TriangleSurface hollow = edged_box();
  for (auto& triangle : hollow.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_TRUE(sharp_edges(hollow).empty());
}

TEST(EdgeSamples, ThatMeetACornerAreOfAllItsFaces) {
  const EdgeSamples samples = samples_of(edged_box(), 4e-3);
  ASSERT_GT(samples.places.size(), 8u);
  for (std::size_t p = 0; p < samples.places.size(); ++p) {
    const auto& faces = samples.faces[p];
    const bool is_corner = faces_at(samples.places[p].position) == 3;
    EXPECT_EQ(is_corner, faces[0] != faces[1] && faces[1] != faces[2] && faces[0] != faces[2]);
  }
}

/// A floor whose edge stands up along y through the origin, below a free block.
SceneDescription block_above_edge(double above) {
  SceneDescription scene = block_on_floor({.above = above, .friction = 0.3});
  Pose& pose = scene.organs[1].pose;
  pose.orientation = Eigen::AngleAxisd(-0.25 * M_PI, Vec3::UnitY());
  pose.position = -(pose.orientation * Vec3(50e-3, 0, 10e-3));
  return scene;
}

bool edges_meet(const World& world) {
  const Pool<EdgeSamples>& edges = world.all<EdgeSamples>();
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (!world.find<PairState>(edges.owner(e))->meetings.empty()) return true;
  return false;
}

/// How deep the edge stands in the block as it is drawn [m].
double depth_of_edge(const World& world) {
  const Entity block = world.model().organs()[0];
  TriangleSurface drawn = world.find<OrganBody>(block)->model->surface;
  const auto& positions = world.find<OrganState>(block)->positions;
  for (std::size_t v = 0; v < positions.size(); ++v)
    drawn.vertices[v] = pose_of(world, block).to_world(positions[v].cast<double>());
  const SurfaceTree tree(drawn);
  double deepest = 0.0;
  for (double y = -13e-3; y <= 13e-3; y += 0.5e-3)
    deepest = std::max(deepest, -tree.signed_distance(Vec3(0, y, 0)));
  return deepest;
}

TEST(EdgeSamples, OfARigidFloorDontStandInWhatFallsOnThem) {
  auto world = build(block_above_edge(5e-3));
  ASSERT_TRUE(world);
  double deepest = 0.0;
  for (int frame = 1; frame <= 18; ++frame) {
    step_until(*world, frame / 60.0);
    deepest = std::max(deepest, depth_of_edge(*world));
  }
  EXPECT_GT(world->one<TouchingFigures>()->greatest_force, 0.05) << "it has come down";
  EXPECT_LT(deepest, 0.5e-3);
}

TEST(EdgeSamples, GoOnFromASavedStateToTheSameBits) {
  auto world = build(block_above_edge(5e-3));
  ASSERT_TRUE(world);
  step_until(*world, 0.1);
  ASSERT_TRUE(edges_meet(*world));
  auto other = start_world(world->shared_model());
  ASSERT_TRUE(other && (*other)->load_state(world->save_state()));
  EXPECT_EQ((*other)->state_difference(*world), "");
  step_until(*world, 0.2);
  step_until(**other, 0.2);
  EXPECT_EQ((*other)->state_difference(*world), "");
}

TEST(EdgeSamples, ThatBeginInsideWhatFallsAreRefusedWithThePlace) {
  const SceneDescription scene = block_above_edge(-0.7e-3);
  std::vector<std::string> warnings;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("begins 0.7 mm inside"), std::string::npos)
      << world.error().text();
}

}  // namespace
}  // namespace viscera::test
