#include <gtest/gtest.h>

#include <numeric>

#include "kernels/paff/cut_cells.h"
#include "kernels/paff/surface_quadrature.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

/// Volume and first moments about the origin of the enclosed body, from the triangles.
Vec4 exact_moments(const TriangleSurface& surface) {
  Vec4 moments = Vec4::Zero();
  for (const std::array<int, 3>& t : surface.triangles) {
    const Vec3& a = surface.vertices[static_cast<std::size_t>(t[0])];
    const Vec3& b = surface.vertices[static_cast<std::size_t>(t[1])];
    const Vec3& c = surface.vertices[static_cast<std::size_t>(t[2])];
    const double tetrahedron = a.dot(b.cross(c)) / 6.0;
    moments[0] += tetrahedron;
    moments.tail<3>() += tetrahedron * 0.25 * (a + b + c);
  }
  return moments;
}

void expect_exact_moments(const TriangleSurface& surface, const LocalSpacing& spacing,
                          SmallCells small = SmallCells::kEight) {
  const Result<VolumeQuadrature> volume =
      background_quadrature(surface, spacing, 1, nullptr, small);
  ASSERT_TRUE(volume) << volume.error().text();
  Vec4 sum = Vec4::Zero();
  for (std::size_t q = 0; q < volume->size(); ++q) {
    ASSERT_GT(volume->weights[q], 0.0);
    sum += volume->weights[q] * (Vec4() << 1.0, volume->positions[q]).finished();
  }
  const Vec4 exact = exact_moments(surface);
  const double reach = bounds(surface).sizes().norm();
  EXPECT_GT(volume->cut_cells, 0u);
  EXPECT_LT(std::abs(sum[0] - exact[0]), 1e-10 * exact[0]);
  EXPECT_LT((sum - exact).tail<3>().norm(), 1e-10 * exact[0] * reach);
}

TEST(BackgroundQuadrature, MeetsVolumeAndFirstMomentsOfACube) {
  const test::Body body = test::jittered_cube(7, 0.2);
  expect_exact_moments(body.surface, LocalSpacing(body.cloud));
}

TEST(BackgroundQuadrature, MeetsVolumeAndFirstMomentsOfASphereWithGradedNodes) {
  const test::Body body = test::placed_body(
      test::icosphere(0.05, 3), graded_spacing(0.014, 0.004, 0.25, {Vec3(0.0, 0.0, 0.05)}));
  ASSERT_GT(body.cloud.size(), 100u);
  expect_exact_moments(body.surface, LocalSpacing(body.cloud));
}

TEST(BackgroundQuadrature, MeetsThemWithOnePointASmallCellThatHalvesThePoints) {
  const test::Body body = test::placed_body(
      test::icosphere(0.05, 3), graded_spacing(0.014, 0.004, 0.25, {Vec3(0.0, 0.0, 0.05)}));
  const LocalSpacing spacing(body.cloud);
  expect_exact_moments(body.surface, spacing, SmallCells::kOne);
  const auto points = [&](SmallCells small) {
    return background_quadrature(body.surface, spacing, 1, nullptr, small)->size();
  };
  EXPECT_LT(points(SmallCells::kOne), 0.6 * static_cast<double>(points(SmallCells::kEight)));
}

TEST(BackgroundQuadrature, MeetsVolumeAndFirstMomentsOfAKidney) {
  const auto file = test::shared_data("visible_human/kidney_left_1080.obj");
  if (!file) GTEST_SKIP() << "the optional data folder is absent";
  const TriangleSurface surface = test::read_simple_obj(file->string());
  const double h = std::cbrt(volume(surface) / 1000.0);
  const test::Body body = test::placed_body(surface, [h](const Vec3&) { return h; });
  expect_exact_moments(body.surface, LocalSpacing(body.cloud));
}

TEST(BackgroundQuadrature, MeetsSecondMomentsOfASphereAtDegreeTwo) {
  const test::Body body =
      test::placed_body(test::icosphere(1.0, 2), [](const Vec3&) { return 0.4; });
  const auto volume = background_quadrature(body.surface, LocalSpacing(body.cloud), 2);
  ASSERT_TRUE(volume) << volume.error().text();
  Mat3 sum = Mat3::Zero(), exact = Mat3::Zero();
  for (std::size_t q = 0; q < volume->size(); ++q) {
    ASSERT_GT(volume->weights[q], 0.0);
    const Vec3 x = volume->positions[q] + Vec3(0.1, 0.2, 0.3);
    sum += volume->weights[q] * x * x.transpose();
  }
  // Over a tetrahedron with corners p_i: V/20 (sum p_i p_i^T + (sum p_i)(sum p_i)^T).
  const Vec3 shift(0.1, 0.2, 0.3);
  for (const std::array<int, 3>& t : body.surface.triangles) {
    Vec3 corners[4] = {shift, Vec3(), Vec3(), Vec3()};
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i + 1] = body.surface.vertices[static_cast<std::size_t>(t[i])] + shift;
    }
    const double tetrahedron =
        (corners[1] - shift).dot((corners[2] - shift).cross(corners[3] - shift)) / 6.0;
    Vec3 total = Vec3::Zero();
    Mat3 products = Mat3::Zero();
    for (const Vec3& p : corners) {
      total += p;
      products += p * p.transpose();
    }
    exact += tetrahedron / 20.0 * (products + total * total.transpose());
  }
  EXPECT_LT((sum - exact).norm(), 1e-10 * exact.norm());
}

TEST(BackgroundQuadrature, IntegratesASmoothFunctionToSecondOrder) {
  const auto error = [](int cells, SmallCells small = SmallCells::kEight) {
    const test::Body body = test::jittered_cube(cells, 0.2);
    const auto volume =
        background_quadrature(body.surface, LocalSpacing(body.cloud), 1, nullptr, small);
    double sum = 0.0;
    for (std::size_t q = 0; q < volume->size(); ++q) {
      const Vec3& x = volume->positions[q];
      sum += volume->weights[q] * std::exp(x.x()) * std::cos(x.y()) * std::cos(x.z());
    }
    const double exact = 2.0 * std::sinh(0.5) * 4.0 * std::sin(0.5) * std::sin(0.5);
    return std::abs(sum - exact) / exact;
  };
  EXPECT_LT(error(5), 2e-3);
  EXPECT_LT(error(10), error(5) / 3.0);
  EXPECT_LT(error(10, SmallCells::kOne), error(5, SmallCells::kOne) / 3.0);
}

TEST(BackgroundQuadrature, RefusesAnOpenSurface) {
  test::Body body = test::jittered_cube(5, 0.0);
  body.surface.triangles.resize(body.surface.triangles.size() - 5);
  const auto volume = background_quadrature(body.surface, LocalSpacing(body.cloud));
  ASSERT_FALSE(volume);
  EXPECT_NE(volume.error().text().find("closed"), std::string::npos);
}

TEST(BackgroundQuadrature, RefusesASurfaceInsideOut) {
  test::Body body = test::jittered_cube(5, 0.0);
  for (std::array<int, 3>& triangle : body.surface.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_FALSE(background_quadrature(body.surface, LocalSpacing(body.cloud)));
}

TEST(SurfaceQuadrature, MeetsAreaAndClosesUp) {
  const test::Body body = test::jittered_cube(6, 0.2);
  const SurfaceQuadrature points = surface_quadrature(
      body.surface, LocalSpacing(body.cloud), [](const Vec3& x) { return x.z() < -0.5 + 1e-9; });
  double total = 0.0, held = 0.0;
  Vec3 closure = Vec3::Zero();
  Mat3 enclosed = Mat3::Zero();
  for (std::size_t b = 0; b < points.size(); ++b) {
    total += points.weights[b];
    held += points.fixed[b] ? points.weights[b] : 0.0;
    closure += points.weights[b] * points.normals[b];
    enclosed += points.weights[b] * points.positions[b] * points.normals[b].transpose();
  }
  EXPECT_NEAR(total, 6.0, 1e-12);
  EXPECT_NEAR(held, 1.0, 1e-12);
  EXPECT_LT(closure.norm(), 1e-13);
  EXPECT_LT((enclosed - Mat3::Identity()).norm(), 1e-12);
}

TEST(SurfaceQuadrature, MeetsFourthMomentsOfAFaceAtDegreeFour) {
  const test::Body body = test::jittered_cube(3, 0.0);
  const SurfaceQuadrature points =
      surface_quadrature(body.surface, LocalSpacing(body.cloud), {}, 4);
  double sum = 0.0;
  for (std::size_t b = 0; b < points.size(); ++b) {
    ASSERT_GT(points.weights[b], 0.0);
    const Vec3& x = points.positions[b];
    if (x.z() > 0.5 - 1e-9) sum += points.weights[b] * x.x() * x.x() * x.y() * x.y();
  }
  EXPECT_NEAR(sum, 1.0 / 144.0, 1e-16);
}

}  // namespace
}  // namespace viscera
