#include "kernels/contact/near_field.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "kernels/base/random.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
const IsotropicMaterial kTissue{1e4, 0.45};
const double kNormalScale = 1.0 / (kPi * kTissue.contact_modulus());
constexpr double kRadius = 0.2e-3;
constexpr double kArea = kPi * kRadius * kRadius;

/// Mean over a disc of radius c about x = r of value(distance to the origin).
template <class Value>
double mean_over_disc(double r, double c, const Value& value) {
  constexpr int kRadii = 400, kAngles = 400;
  double sum = 0.0;
  for (int i = 0; i < kRadii; ++i) {
    const double s = c * std::sqrt((i + 0.5) / kRadii);
    for (int j = 0; j < kAngles; ++j) {
      const double angle = kPi * (j + 0.5) / kAngles;
      sum += value(std::sqrt(r * r + s * s + 2.0 * r * s * std::cos(angle)));
    }
  }
  return sum / (kRadii * kAngles);
}

/// Potential of a uniform unit charge on a disc [Love1929].
double disc_potential(double r, double c) {
  const double d = r / c;
  if (d <= 1.0) return 4.0 * std::comp_ellint_2(d) / (kPi * c);
  const double k = 1.0 / d;
  return 4.0 * d / (kPi * c) * (std::comp_ellint_2(k) - (1.0 - k * k) * std::comp_ellint_1(k));
}

/// Along the normal, r apart, under a unit force along it: the mean over another cell, and of a
/// point.
double cell_normal(const NearField& field, double r, double area) {
  return field.cell_response(Vec3(r, 0, 0), Vec3::UnitZ(), area)(2, 2);
}
double drawn_normal(const NearField& field, double r, double area) {
  return field.drawn_displacement(Vec3(r, 0, 0), Vec3::UnitZ(), area, Vec3::UnitZ()).z();
}

/// Response of two discs without the spread part: at a great sigma that is a small constant.
double disc_disc(double r) {
  const double sigma = 1e3 * kRadius;
  return cell_normal(NearField(kTissue, sigma), r, kArea) / kNormalScale +
         std::sqrt(kPi) / (2.0 * sigma);
}

TEST(NearField, SelfTermIsTheMeanDisplacementOfAUniformlyLoadedDisc) {
  EXPECT_NEAR(disc_disc(0.0) * kRadius, 16.0 / (3.0 * kPi), 1e-6);
}

TEST(NearField, PairTermsAgreeWithIntegrationOverBothDiscs) {
  for (const double d : {0.1, 0.5, 1.0, 1.5, 1.905, 2.0, 2.5, 3.9, 4.1, 6.0, 12.0}) {
    const double exact =
        mean_over_disc(d * kRadius, kRadius, [](double r) { return disc_potential(r, kRadius); });
    EXPECT_NEAR(disc_disc(d * kRadius) / exact, 1.0, 1e-3) << "at " << d << " radii";
  }
}

TEST(NearField, DrawnDisplacementIsThatOfLovesDisc) {
  const double sigma = 1e3 * kRadius;
  const NearField field(kTissue, sigma);
  const double spread = std::sqrt(kPi / 2.0) / sigma;
  EXPECT_NEAR((drawn_normal(field, 0.0, kArea) / kNormalScale + spread) * kRadius, 2.0, 1e-6);
  EXPECT_NEAR((drawn_normal(field, kRadius, kArea) / kNormalScale + spread) * kRadius, 4.0 / kPi,
              1e-6);
  for (const double d : {0.5, 1.5, 3.99, 4.01, 8.0}) {
    EXPECT_NEAR(drawn_normal(field, d * kRadius, kArea) / kNormalScale + spread,
                disc_potential(d * kRadius, kRadius), 1e-4 * disc_potential(d * kRadius, kRadius));
  }
}

TEST(NearField, FallsSmoothlyToNothingAtItsRange) {
  const NearField field(kTissue, 3e-3);
  const double at_sigma = std::abs(cell_normal(field, 3e-3, kArea));
  double before = cell_normal(field, 0.5 * field.range(), kArea);
  for (int i = 1; i <= 200; ++i) {
    const double r = field.range() * (0.5 + 0.51 * i / 200.0);
    const double here = cell_normal(field, r, kArea);
    EXPECT_LT(std::abs(here - before), 1e-3 * at_sigma);
    before = here;
  }
  EXPECT_EQ(cell_normal(field, field.range(), kArea), 0.0);
  EXPECT_EQ(drawn_normal(field, 1.1 * field.range(), kArea), 0.0);
}

TEST(NearField, BeyondTheDrawnRangeNothingIsVisible) {
  const NearField field(kTissue, 3e-3);
  for (const double force : {1e-4, 1e-2, 0.3, 5.0}) {
    const double r = field.drawn_range(force);
    EXPECT_LE(r, field.range());
    EXPECT_GE(r, 3.0 * field.sigma());
    if (r == field.range()) continue;
    for (const double beyond : {1.0, 1.2, 2.0}) {
      EXPECT_LT(force * std::abs(drawn_normal(field, beyond * r, kArea)), 1e-6) << force;
    }
  }
}

TEST(NearField, StaysFiniteFarFromTheCell) {
  const NearField field(kTissue, 1e-6);
  EXPECT_EQ(cell_normal(field, 1.0, kArea), 0.0);
  EXPECT_TRUE(std::isfinite(cell_normal(field, 16e-6, 1e-14)));
}

/// 3 x 3 responses of all cells to all.
MatrixX response_among(const NearField& field, const std::vector<Vec3>& places, double area) {
  const auto n = static_cast<Eigen::Index>(places.size());
  MatrixX matrix(3 * n, 3 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l) {
      matrix.block<3, 3>(3 * k, 3 * l) = field.cell_response(
          places[static_cast<std::size_t>(k)] - places[static_cast<std::size_t>(l)], Vec3::UnitZ(),
          area);
    }
  }
  return matrix;
}

TEST(NearField, GridOfCellsIsPositiveAndReciprocal) {
  const double pitch = 0.26e-3, area = pitch * pitch * std::sqrt(0.75);
  std::vector<Vec3> places;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      places.push_back({pitch * (i + 0.5 * j), pitch * std::sqrt(0.75) * j, 0.0});
    }
  }
  for (const double nu : {0.0, 0.3, 0.499}) {
    const MatrixX matrix = response_among(NearField({1e4, nu}, 3e-3), places, area);
    EXPECT_LT((matrix - matrix.transpose()).norm(), 1e-14 * matrix.norm());
    const VectorX eigenvalues = Eigen::SelfAdjointEigenSolver<MatrixX>(matrix).eigenvalues();
    EXPECT_GT(eigenvalues[0], 1e-3 * eigenvalues[eigenvalues.size() - 1]) << nu;
  }
}

TEST(NearField, CellsFarApartAndCloseArePositiveTogether) {
  // Out to beyond the range: the taper at its end takes nothing from the positivity.
  const Random random(11, 1);
  std::vector<Vec3> places;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const double reach = i < 30 ? 2e-3 : 60e-3;
    places.push_back(reach * Vec3(random.uniform(2 * i), random.uniform(2 * i + 1), 0.0));
  }
  for (const double nu : {0.0, 0.3, 0.499}) {
    const MatrixX matrix = response_among(NearField({1e4, nu}, 3e-3), places, kArea);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(matrix).eigenvalues()[0], 0.0) << nu;
  }
}

TEST(NearField, DrawnDisplacementHasThePartsOfTheCellResponse) {
  // A small cell seen from afar is a point, whichever way it is asked.
  const NearField field({1e4, 0.3}, 3e-3);
  const Vec3 offset(1.6e-3, 0.8e-3, 0), force(1e-3, -2e-3, 3e-3);
  const double area = 1e-12;
  const NearField twice({1e4, 0.3}, 3e-3 / std::numbers::sqrt2);  // spread once, not twice
  const Vec3 drawn = field.drawn_displacement(offset, Vec3::UnitZ(), area, force);
  EXPECT_LT((drawn - twice.cell_response(offset, Vec3::UnitZ(), area) * force).norm(),
            1e-6 * drawn.norm());
  EXPECT_NE(drawn.x(), 0.0);
}

}  // namespace
}  // namespace viscera
