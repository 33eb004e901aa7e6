#include "kernels/contact/surface_strains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

constexpr double kRadius = 25e-3;

/// A ball with a sample at each vertex of a coarser one.
struct Sampled {
  std::vector<Vec3f> vertices, normals;
  SurfaceGradients gradients;

  Sampled() : Sampled(test::icosphere(kRadius, 4), test::icosphere(kRadius, 2)) {}
  Sampled(const TriangleSurface& drawn, const TriangleSurface& coarse)
      : vertices(in_single(drawn.vertices)),
        normals(in_single(vertex_normals(drawn))),
        gradients(vertices, normals, coarse.vertices, vertex_normals(coarse),
                  std::vector<double>(coarse.vertices.size(), 5e-3)) {}

  static std::vector<Vec3f> in_single(const std::vector<Vec3>& values) {
    std::vector<Vec3f> single;
    for (const Vec3& value : values) single.push_back(value.cast<float>());
    return single;
  }
  template <class Motion>
  SurfaceStrains under(const Motion& motion) const {
    // An expression of values that are gone by then would do elsewhere.
    static_assert(std::is_same_v<std::invoke_result_t<Motion, Vec3>, Vec3>);
    std::vector<Vec3f> moved;
    for (const Vec3f& x : vertices) moved.push_back(Vec3(motion(x.cast<double>())).cast<float>());
    return gradients.greatest(moved);
  }
};

const Vec3 kAxis = Vec3(1, -2, 0.5).normalized();

TEST(SurfaceStrains, ASurfaceAtRestOrCarriedAlongHasNone) {
  const Sampled ball;
  EXPECT_EQ(ball.gradients.size(), 162u);
  const SurfaceStrains rest = ball.gradients.greatest(ball.vertices);
  EXPECT_LT(rest.rotation, 2e-3);  // of single precision, whose root it is
  EXPECT_LT(rest.stretch, 1e-5);
  const SurfaceStrains carried =
      ball.under([](const Vec3& x) -> Vec3 { return x + Vec3(0.1, 0, -0.2); });
  EXPECT_LT(carried.rotation, 5e-3);
  EXPECT_LT(carried.stretch, 2e-5);
}

TEST(SurfaceStrains, ARotationIsFoundAndIsNoStretch) {
  const Sampled ball;
  for (const double angle : {0.05, 0.2, 1.0, 2.5}) {
    const Mat3 turn = Eigen::AngleAxisd(angle, kAxis).toRotationMatrix();
    const SurfaceStrains found = ball.under([&](const Vec3& x) -> Vec3 { return turn * x; });
    EXPECT_NEAR(found.rotation, angle, 2e-4) << angle;
    EXPECT_LT(found.stretch, 1e-5) << angle;
  }
}

TEST(SurfaceStrains, AStretchIsFoundAlsoWhereTheSurfaceTurns) {
  const Sampled ball;
  Mat3 stretch = Vec3(0.93, 1.25, 0.93).asDiagonal();
  for (const double angle : {0.0, 0.4}) {
    const Mat3 turn = Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
    const SurfaceStrains found =
        ball.under([&](const Vec3& x) -> Vec3 { return turn * stretch * x; });
    // Pieces that have the axis in them are lengthened by all of it; samples miss it by what they
    // are tilted, about 5 degrees at most.
    EXPECT_NEAR(found.stretch, 0.25, 0.005) << angle;
    // Pieces whose normal lies askew are turned by the stretch alone, by atan of what it does to
    // the angle: at most (1.25 - 0.93) / (1.25 + 0.93) on both sides.
    EXPECT_LT(found.rotation, angle + 0.16) << angle;
    EXPECT_GT(found.rotation, angle) << angle;
  }
}

TEST(SurfaceStrains, ShorteningCountsAsLengtheningDoes) {
  const Sampled ball;
  const SurfaceStrains found = ball.under([](const Vec3& x) -> Vec3 { return 0.8 * x; });
  EXPECT_NEAR(found.stretch, 0.2, 1e-4);
  EXPECT_LT(found.rotation, 3e-3);
}

TEST(SurfaceStrains, OfABentSurfaceTheGreatestAngleIsTold) {
  // A ball bent about the y axis: turned by up to 0.3 rad at its ends.
  const Sampled ball;
  const double bend = 0.3 / kRadius;
  const SurfaceStrains found = ball.under([&](const Vec3& x) -> Vec3 {
    const double angle = bend * x.x(), radius = 1.0 / bend - x.z();
    return Vec3(radius * std::sin(angle), x.y(), 1.0 / bend - radius * std::cos(angle));
  });
  EXPECT_NEAR(found.rotation, 0.3, 0.03);
  EXPECT_NEAR(std::abs(found.rotated.x()), kRadius, 2e-3);
  EXPECT_NEAR(std::abs(found.stretched.z()), kRadius, 2e-3);
  EXPECT_NEAR(found.stretch, 0.3, 0.03);  // where x = 0, at the poles: z / (bending radius)
}

TEST(SurfaceStrains, BoundHoldsForAnyDisplacement) {
  const Sampled ball;
  const double amplitude = 0.1e-3;
  for (int wave = 1; wave < 40; wave += 3) {
    const SurfaceStrains found = ball.under([&](const Vec3& x) -> Vec3 {
      return x + amplitude *
                     Vec3(std::sin(wave * 40.0 * x.y()), std::cos(wave * 55.0 * x.z()),
                          std::sin(wave * 35.0 * x.x())) /
                     std::sqrt(3.0);
    });
    EXPECT_LT(found.rotation, 1.2 * amplitude * ball.gradients.bound() + 2e-3) << wave;
    EXPECT_LT(found.stretch, amplitude * ball.gradients.bound() + 1e-5) << wave;
  }
}

TEST(SurfaceStrains, PlacesWithoutASurfaceAboutThemAreLeftOut) {
  const TriangleSurface drawn = test::icosphere(kRadius, 3);
  const std::vector<Vec3f> vertices = Sampled::in_single(drawn.vertices);
  const std::vector<Vec3f> normals = Sampled::in_single(vertex_normals(drawn));
  const std::vector<Vec3> places{Vec3(0, 0, kRadius), Vec3(0, 0, kRadius), Vec3(1, 0, 0)};
  const std::vector<Vec3> ways{Vec3::UnitZ(), -Vec3::UnitZ(), Vec3::UnitX()};
  const SurfaceGradients gradients(vertices, normals, places, ways,
                                   std::vector<double>(places.size(), 3e-3));
  EXPECT_EQ(gradients.size(), 1u);
}

}  // namespace
}  // namespace viscera
