// What tools/mutate found that whole contacts forgive, by figures worked out by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/contact/half_space.h"
#include "kernels/contact/near_field.h"
#include "kernels/contact/touchable_surface.h"

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

}  // namespace
}  // namespace viscera
