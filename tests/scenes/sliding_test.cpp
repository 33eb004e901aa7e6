// A millimetre tip over the liver: the force must not know where the nodes are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/collision/collision_surface.h"
#include "engine/organ/shape.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 1e-3;   // a 1 mm tip [m]
constexpr double kDepth = 1.5e-3;  // held while it slides [m]
constexpr double kStart = 0.3;     // sliding begins [s]
constexpr double kEnd = 2.3;
constexpr double kLength = 16e-3;  // of the slide: several node spacings [m]

OrganDescription liver(double finest) {
  OrganDescription organ;
  organ.name = "liver";
  RecipeGeometry geometry;
  geometry.recipe = "liver";
  organ.geometry = geometry;
  organ.tissue = "rubber";
  Region back;
  back.shape = Region::Shape::kHalfSpace;
  back.b = Vec3::UnitZ();
  organ.fixed = {back};
  organ.resolution.spacing = 4.0 * finest;
  organ.resolution.finest = finest;
  return organ;
}

/// A tip path at constant depth under the rest surface along +x over the liver's upper face.
std::vector<InstrumentKey> sliding_path(const TriangleSurface& surface) {
  const Box box = bounds(surface);
  const CollisionSurface collision(surface, [&] {
    static std::vector<Vec3f> positions;
    positions.clear();
    for (const Vec3& v : surface.vertices) positions.push_back(v.cast<float>());
    return std::span<const Vec3f>(positions);
  }());
  const std::vector<Vec3> normals = vertex_normals(surface);
  const Vec3 centre = box.center();
  std::vector<InstrumentKey> keys;
  const int steps = 64;
  for (int i = -1; i <= steps; ++i) {
    const double x = centre.x() - 0.5 * kLength + kLength * std::max(i, 0) / steps;
    const auto hit = collision.cast(Vec3(x, centre.y(), box.max().z() + 0.01), -Vec3::UnitZ(), 0.5);
    if (!hit) return {};
    const auto& corners = surface.triangles[static_cast<std::size_t>(hit->point.triangle)];
    Vec3 normal = Vec3::Zero();
    for (int c = 0; c < 3; ++c)
      normal += hit->point.weights[c] *
                normals[static_cast<std::size_t>(corners[static_cast<std::size_t>(c)])];
    InstrumentKey key;
    const double height = i < 0 ? kRadius + 2e-3 : kRadius - kDepth;
    key.time = i < 0 ? 0.0 : kStart + (kEnd - kStart) * i / steps;
    key.tip = hit->position + height * normal.normalized();
    keys.push_back(key);
  }
  return keys;
}

/// Force of each frame of the slide [N].
std::optional<VectorX> slide_over_liver(double finest) {
  SceneDescription scene;
  scene.file = "slide";
  scene.name = "slide";
  scene.duration = kEnd;
  scene.organs = {liver(finest)};
  const auto surface = build_shape(scene.organs[0].geometry, project_file("assets"));
  if (!surface) {
    ADD_FAILURE() << surface.error().text();
    return std::nullopt;
  }
  const auto keys = sliding_path(*surface);
  if (keys.empty()) return std::nullopt;
  InstrumentDescription tip = straight_tool("tip", InstrumentKind::kProbe, kRadius, keys);
  scene.instruments = {tip};
  auto world = build(scene);
  if (!world) return std::nullopt;
  step_until(*world, kStart + 0.1);
  std::vector<double> forces;
  while (world->time() < kEnd - 0.05) {
    step_until(*world, world->time() + 1.0 / 60.0);
    forces.push_back(force_on(*world, 0).norm());
  }
  return VectorX::Map(forces.data(), static_cast<Eigen::Index>(forces.size()));
}

/// Greatest deviation of one slide from another on other nodes, the ratio of their means taken out,
/// as a share. What the liver's own shape does to the force both have in common; what nodes do,
/// they don't. Sees the ripple of both, and leaves no slow part of either to a fit.
double ripple_between(const VectorX& one, const VectorX& other) {
  const VectorX ratio = one.cwiseQuotient(other);
  return (ratio.array() / ratio.mean() - 1.0).abs().maxCoeff();
}

/// The same about a fitted parabola, part of it the liver's shape.
double ripple_about_trend(const VectorX& force) {
  const VectorX place = VectorX::LinSpaced(force.size(), -1.0, 1.0);
  MatrixX basis(force.size(), 3);
  basis << VectorX::Ones(force.size()), place, place.cwiseAbs2();
  const VectorX fit = basis * (basis.transpose() * basis).inverse() * (basis.transpose() * force);
  return (force - fit).cwiseAbs().maxCoeff() / force.mean();
}

TEST(Sliding, AMillimetreTipFeelsSmoothLiverAtAnySpacing) {
  const auto coarse = slide_over_liver(6e-3);
  const auto fine = slide_over_liver(3e-3);
  ASSERT_TRUE(coarse && fine);
  ASSERT_EQ(coarse->size(), fine->size());
  const double change = fine->mean() / coarse->mean() - 1.0,
               ripple = ripple_between(*coarse, *fine);
  RecordProperty("coarse_mean_N", std::to_string(coarse->mean()));
  RecordProperty("fine_mean_N", std::to_string(fine->mean()));
  std::printf(
      "spacing 6 mm: mean %.5f N, about its trend %.2f %%; 3 mm: mean %.5f N, about its trend "
      "%.2f %%; ripple between the two %.2f %%; halving changes the mean by %.2f %%\n",
      coarse->mean(), 100 * ripple_about_trend(*coarse), fine->mean(),
      100 * ripple_about_trend(*fine), 100 * ripple, 100 * std::abs(change));
  EXPECT_GT(fine->minCoeff(), 0.0);
  // What is promised is 5 % of ripple and 10 % between spacings; these hold what is reached.
  EXPECT_LT(ripple, 0.004);
  EXPECT_NEAR(change, 0.0, 0.04);
}

}  // namespace
}  // namespace viscera::test
