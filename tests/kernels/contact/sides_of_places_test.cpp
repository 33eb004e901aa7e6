#include "kernels/contact/sides_of_places.h"

#include <gtest/gtest.h>

#include "kernels/contact/same_side.h"
#include "kernels/formulations/formulations.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

constexpr double kEdge = 20e-3, kSpacing = 4e-3, kGap = 0.3 * kSpacing;

/// Two cubes a third of a spacing apart.
class SidesOfTwoCubes : public testing::Test {
 protected:
  SidesOfTwoCubes() {
    const ShapeFunctions fields = galerkin_formulation().fields(body.surface, body.cloud);
    places = place_on_surface(body.surface, fields).value();
  }
  bool same(std::size_t a, std::size_t b) const {
    return same_side(places.paths.get(), kSideDepth * places.spacings[a], places.positions[a],
                     places.normals[a], places.positions[b], places.normals[b]);
  }
  static bool is_first(const Vec3& x) { return x.x() < 0.5 * kGap; }

  test::Body body =
      test::placed_body(test::two_cubes(kEdge, kGap, 5), [](const Vec3&) { return kSpacing; });
  SurfacePlaces places;
};

TEST_F(SidesOfTwoCubes, AreWhatWaysThroughTissueSayWhateverWasAskedBefore) {
  const SidesOfPlaces sides(places);
  std::size_t beyond = 0;
  for (std::size_t a = 0; a < places.size(); a += 7)
    for (std::size_t b = 0; b < a; ++b) {
      const bool parted = !same(a, b);
      for (int time = 0; time < 2; ++time) {
        EXPECT_EQ(sides.beyond_air(a, b), parted) << a << " and " << b;
        EXPECT_EQ(sides.beyond_air(b, a), parted) << b << " and " << a;
      }
      EXPECT_EQ(is_first(places.positions[a]) != is_first(places.positions[b]), parted);
      if (parted) ++beyond;
    }
  EXPECT_GT(beyond, 100u);
}

TEST_F(SidesOfTwoCubes, HaveTheNearestPlaceToARimOnItsOwnCube) {
  const SidesOfPlaces sides(places);
  for (const double x : {-0.1e-3, kGap + 0.1e-3}) {
    const Vec3 rim(x, 0.0, 0.5 * kEdge);
    EXPECT_EQ(is_first(places.positions[sides.nearest(rim, Vec3::UnitZ())]), is_first(rim));
  }
}

}  // namespace
}  // namespace viscera
