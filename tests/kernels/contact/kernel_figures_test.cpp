// What tools/mutate found that whole contacts forgive, by figures worked out by hand.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "kernels/contact/half_space.h"
#include "kernels/contact/near_field.h"
#include "kernels/contact/touchable_surface.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

TEST(HalfSpace, DiscKernelsHaveNoStepWhereTheMultipoleSeriesBegins) {
  // At four radii. What the series leaves out is 0.01 / 4^10 of the kernel.
  const double radius = 1.0, hair = 1e-12;
  const RadialKernels below = disc_to_point(4.0 * radius - hair, radius),
                      above = disc_to_point(4.0 * radius + hair, radius);
  EXPECT_NEAR(below.monopole, above.monopole, 2e-8);
  EXPECT_NEAR(below.dipole, above.dipole, 1e-10);
  EXPECT_NEAR(below.quadrupole, above.quadrupole, 2e-8);
}

TEST(NearField, HasFallenToAThousandthShortOfItsRange) {
  const NearField field({1e4, 0.45}, 3e-3);
  const auto along_normal = [&](double share) {
    return field.cell_response(Vec3(share * field.range(), 0, 0), Vec3::UnitZ(), 1e-7)(2, 2);
  };
  // The last quarter of the range falls as t^2 (3 - 2 t): 1.2e-5 of 3e-3 away from its end.
  EXPECT_LT(std::abs(along_normal(0.998)), 1e-3 * std::abs(along_normal(0.75)));
  EXPECT_GT(std::abs(along_normal(0.875)), 0.2 * std::abs(along_normal(0.75)));
}

SurfacePlaces along_x(const std::vector<double>& x, const std::vector<double>& spacings) {
  SurfacePlaces places;
  for (std::size_t i = 0; i < x.size(); ++i) {
    places.positions.emplace_back(x[i], 0.0, 0.0);
    places.normals.push_back(Vec3::UnitZ());
    places.areas.push_back(1e-6);
    places.spacings.push_back(spacings[i]);
  }
  return places;
}

const auto kAll = [](const Vec3&) { return true; };

TEST(TouchableSurface, TheSpacingSomewhereIsAMeanThatFallsWithTheDistance) {
  const TouchableSurface surface = touchable_part(along_x({0.0, 2e-3}, {1e-3, 2e-3}), kAll).value();
  // Within three times 1 mm: 1 of the first, (1 - 4/9)^2 of the second.
  const double far = 25.0 / 81.0;
  EXPECT_NEAR(spacing_at(surface, Vec3::Zero()), (1e-3 + far * 2e-3) / (1.0 + far), 1e-12);
  // Far off there is the nearest place's alone.
  EXPECT_NEAR(spacing_at(surface, Vec3(-1.0, 0.0, 0.0)), 1e-3, 1e-12);
}

TEST(TouchableSurface, WhatLiesWithinASpacingOfAPlaceIsTouchable) {
  const TouchableSurface surface =
      touchable_part(along_x({0.0, 2e-3, 9e-3}, {1e-3, 1e-3, 1e-3}), kAll).value();
  for (const Vec3& place : surface.positions) {
    EXPECT_TRUE(is_touchable(surface, place));
    EXPECT_TRUE(is_touchable(surface, place + Vec3(0.0, 0.9e-3, 0.0)));
    EXPECT_TRUE(is_touchable(surface, place - Vec3(0.0, 0.0, 0.9e-3)));
    EXPECT_FALSE(is_touchable(surface, place + Vec3(0.0, 1.1e-3, 0.0)));
  }
  EXPECT_FALSE(is_touchable(surface, Vec3(5e-3, 0.0, 0.0)));
  EXPECT_FALSE(is_touchable(surface, Vec3(-1.0, 0.0, 0.0)));
}

/// A square grid of places a millimetre apart, in the plane z = 0.
TouchableSurface square_grid() {
  SurfacePlaces places;
  for (int j = -6; j <= 6; ++j)
    for (int i = -6; i <= 6; ++i) {
      places.positions.emplace_back(1e-3 * i, 1e-3 * j, 0.0);
      places.normals.push_back(Vec3::UnitZ());
      places.areas.push_back(1e-6);
      places.spacings.push_back(1e-3);
    }
  return touchable_part(places, kAll).value();
}

TEST(TouchableSurface, AFewPlacesCarryALoadWithItsCentreAndItsWidth) {
  const TouchableSurface surface = square_grid();
  const Vec3 x(0.3e-3, 0.1e-3, 0.0);
  for (const double sigma : {0.5e-3, 0.6e-3, 0.85e-3}) {
    std::vector<LoadShare> shares;
    ASSERT_TRUE(spread_load(surface, x, Vec3::UnitZ(), sigma, shares));
    EXPECT_LT(shares.size(), 30u);
    Vec3 centre = Vec3::Zero();
    Mat3 spread = Mat3::Zero();
    for (const auto& [place, share] : shares) {
      const Vec3 offset = surface.positions[static_cast<std::size_t>(place)] - x;
      centre += share * offset;
      spread += share * offset * offset.transpose();
    }
    // (1 - (r / R)^2)^3 with R = 3.058 sigma has the variance R^2 / 10 along each axis.
    const double variance = 0.1 * std::pow(3.058 * sigma, 2);
    EXPECT_LT(centre.norm(), 1e-6 * sigma);
    EXPECT_NEAR(spread(0, 0), variance, 1e-5 * variance) << sigma;
    EXPECT_NEAR(spread(1, 1), variance, 1e-5 * variance) << sigma;
    EXPECT_NEAR(spread(0, 1), 0.0, 1e-5 * variance) << sigma;
  }
}

TEST(TouchableSurface, ToWidenALoadNoShareIsChangedByMoreThanHalf) {
  // On a place, so narrow that four neighbours alone are in reach besides, and hardly.
  const double reach = 3.058 * 0.4;  // [mm]
  std::vector<LoadShare> shares;
  const TouchableSurface surface = square_grid();
  ASSERT_TRUE(spread_load(surface, Vec3::Zero(), Vec3::UnitZ(), 0.4e-3, shares));
  ASSERT_EQ(shares.size(), 5u);
  const double weight = std::pow(1.0 - 1.0 / (reach * reach), 3), sum = 1.0 + 4.0 * weight;
  for (const auto& [place, share] : shares) {
    const bool middle = surface.positions[static_cast<std::size_t>(place)].isZero(1e-9);
    EXPECT_NEAR(share, middle ? 1.0 - 6.0 * weight / sum : 1.5 * weight / sum, 1e-5);
  }
}

TEST(PatchContact, ACompliancesNegativeEigenvaluesAreRaisedToTheRidgeAndNoFarther) {
  // Where it is indefinite: tools of several sizes at one spot of a thin pad.
  const double top = 1.5e-3;
  const test::PressedBody pad =
      test::prepare_block(Vec3(0.03, 0.03, 2.0 * top), 2.5e-3, 0.01, test::kTissue);
  ASSERT_TRUE(pad.ready);
  PatchContact contact(pad.compliance, pad.touch, test::kTissue);
  std::vector<ContactCell> cells;
  for (const double pitch : {0.1e-3, 0.3e-3, 0.6e-3, 1.1e-3, 1.7e-3}) {
    const auto more = test::plane_cells(Vec3(0, 0, top), pitch, 2, 0.0, 0.1e-3);
    cells.insert(cells.end(), more.begin(), more.end());
  }
  ContactSolution solution;
  ContactResponse response;
  contact.solve(cells, solution, response);
  ASSERT_GT(solution.lifted, 0.0);
  const auto n = static_cast<Eigen::Index>(cells.size());
  MatrixX matrix(n, n);
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index l = 0; l < n; ++l)
      matrix(k, l) = contact.cell_response()(3 * k + 2, 3 * l + 2);
  const VectorX scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const auto smallest = [&](const MatrixX& of) {
    const MatrixX scaled = scale.asDiagonal() * of * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<MatrixX>(scaled).eigenvalues()[0];
  };
  const double before = smallest(matrix);
  EXPECT_LT(before, -1e-4);
  EXPECT_NEAR(smallest(matrix + contact.state().lifted), 0.0, 0.1 * std::abs(before));
}

}  // namespace
}  // namespace viscera
