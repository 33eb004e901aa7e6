#include "kernels/contact/half_space.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "kernels/base/random.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

/// Mean of (1, cos a, cos 2a) kernel(|y|) over a density about x = (r, 0), y = (|y|, a) seen from
/// the origin, in polar coordinates about the origin.
template <class Density>
RadialKernels point_kernels_under(const Density& density, double end) {
  constexpr int kRadii = 3000, kAngles = 600;
  RadialKernels sum;
  for (int i = 0; i < kRadii; ++i) {
    const double t = end * (i + 0.5) / kRadii;
    for (int j = 0; j < kAngles; ++j) {
      const double angle = kPi * (j + 0.5) / kAngles;
      // 1 / t of the point's field and t of the polar area cancel.
      const double value = density(t * std::cos(angle), t * std::sin(angle));
      sum.monopole += value;
      sum.dipole += value * std::cos(angle);
      sum.quadrupole += value * std::cos(2.0 * angle);
    }
  }
  return sum * ((end / kRadii) * (2.0 * kPi / kAngles));
}

void expect_near(const RadialKernels& one, const RadialKernels& other, double tolerance) {
  EXPECT_NEAR(one.monopole, other.monopole, tolerance);
  EXPECT_NEAR(one.dipole, other.dipole, tolerance);
  EXPECT_NEAR(one.quadrupole, other.quadrupole, tolerance);
}

TEST(HalfSpace, DiscKernelsAgreeWithIntegrationOverTheDisc) {
  for (const double r : {0.0, 0.05, 0.4, 0.9, 1.3, 2.5, 3.9, 4.1, 7.0}) {
    SCOPED_TRACE(r);
    const RadialKernels exact = point_kernels_under(
        [r](double x, double y) { return (x - r) * (x - r) + y * y < 1.0 ? 1.0 / kPi : 0.0; },
        r + 1.0);
    expect_near(disc_to_point(r, 1.0), exact, 3e-3);
    expect_near(disc_to_point(2.0 * r, 2.0), exact * 0.5, 3e-3);
  }
}

TEST(HalfSpace, PairKernelsAreTheMeanOfDiscKernelsOverADisc) {
  constexpr int kRadii = 200, kAngles = 200;
  for (const double r : {0.0, 0.3, 1.0, 1.905, 2.4, 3.95, 4.05, 9.0}) {
    SCOPED_TRACE(r);
    RadialKernels mean;
    for (int i = 0; i < kRadii; ++i) {
      const double s = std::sqrt((i + 0.5) / kRadii);
      for (int j = 0; j < kAngles; ++j) {
        const double angle = kPi * (j + 0.5) / kAngles;
        const Vec2 at(r + s * std::cos(angle), s * std::sin(angle));
        const RadialKernels here = disc_to_point(at.norm(), 1.0);
        const double turn = std::atan2(at.y(), at.x());
        mean.monopole += here.monopole;
        mean.dipole += here.dipole * std::cos(turn);
        mean.quadrupole += here.quadrupole * std::cos(2.0 * turn);
      }
    }
    expect_near(disc_to_disc(r, 1.0), mean * (1.0 / (kRadii * kAngles)), 3e-4);
  }
}

TEST(HalfSpace, GaussianKernelsAgreeWithIntegrationOverTheGaussian) {
  for (const double r : {0.0, 0.2, 1.0, 2.7, 3.9, 4.5, 9.0}) {
    SCOPED_TRACE(r);
    const RadialKernels exact = point_kernels_under(
        [r](double x, double y) {
          return std::exp(-0.5 * ((x - r) * (x - r) + y * y)) / (2.0 * kPi);
        },
        r + 8.0);
    expect_near(gaussian_to_point(r, 1.0), exact, 1e-5);
  }
}

TEST(HalfSpace, PointForcesMoveTheSurfaceAsBoussinesqAndCerrutiSay) {
  const double nu = 0.3, shear = 1e3, r = 2e-3;
  const HalfSpace half_space({2.0 * shear * (1.0 + nu), nu});
  const RadialKernels point{1.0 / r, 1.0 / r, 1.0 / r};
  const Mat3 moved = half_space.response(point, Vec3(r, 0, 0), Vec3::UnitZ());
  const double scale = 1.0 / (2.0 * kPi * shear * r);
  // Pressing (-z) draws the surface towards the load [Johnson1985] eq. 3.18, 3.19; dragging along x
  // by eq. 3.75-3.77 presses the surface ahead of it down.
  EXPECT_NEAR(moved(2, 2), scale * (1.0 - nu), 1e-12 * scale);
  EXPECT_NEAR(moved(0, 2), scale * 0.5 * (1.0 - 2.0 * nu), 1e-12 * scale);
  EXPECT_NEAR(moved(2, 0), -scale * 0.5 * (1.0 - 2.0 * nu), 1e-12 * scale);
  EXPECT_NEAR(moved(0, 0), scale, 1e-12 * scale);
  EXPECT_NEAR(moved(1, 1), scale * (1.0 - nu), 1e-12 * scale);
  EXPECT_EQ(moved(0, 1), 0.0);
}

TEST(HalfSpace, ResponseIsReciprocalAndTurnsWithTheSurface) {
  const HalfSpace half_space({1e4, 0.2});
  const RadialKernels kernels{3.0, 2.0, 1.0};
  const Vec3 offset(0.3, -0.2, 0.1), normal = Vec3(0.2, 0.4, 0.9).normalized();
  const Mat3 there = half_space.response(kernels, offset, normal);
  EXPECT_LT((there - half_space.response(kernels, -offset, normal).transpose()).norm(),
            1e-15 * there.norm());
  const Mat3 turn = Quaternion(0.5, 0.1, -0.7, 0.3).normalized().toRotationMatrix();
  EXPECT_LT(
      (turn * there * turn.transpose() - half_space.response(kernels, turn * offset, turn * normal))
          .norm(),
      1e-14 * there.norm());
  const Vec3 force(1, 2, -3);
  EXPECT_LT((there * force - half_space.displacement(kernels, offset, normal, force)).norm(),
            1e-14 * there.norm());
}

TEST(HalfSpace, OverlappingCellsArePositiveAtEveryPoissonRatio) {
  // Two tools at one place: cells lie anyhow.
  const Random random(7, 1);
  std::vector<Vec3> places;
  for (std::uint64_t i = 0; i < 40; ++i) {
    places.push_back(2e-3 * Vec3(random.uniform(2 * i), random.uniform(2 * i + 1), 0.0));
  }
  const auto n = static_cast<Eigen::Index>(places.size());
  for (const double nu : {0.0, 0.3, 0.499}) {
    const HalfSpace half_space({1e4, nu});
    MatrixX matrix(3 * n, 3 * n);
    for (Eigen::Index k = 0; k < n; ++k) {
      for (Eigen::Index l = 0; l < n; ++l) {
        const Vec3 offset =
            places[static_cast<std::size_t>(k)] - places[static_cast<std::size_t>(l)];
        matrix.block<3, 3>(3 * k, 3 * l) =
            half_space.response(disc_to_disc(offset.norm(), 0.2e-3), offset, Vec3::UnitZ());
      }
    }
    EXPECT_LT((matrix - matrix.transpose()).norm(), 1e-14 * matrix.norm());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(matrix).eigenvalues()[0], 0.0) << nu;
  }
}

}  // namespace
}  // namespace viscera
