#include "kernels/contact/same_side.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/contact/deformation.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/contact/surface_carriers.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

constexpr double kEdge = 20e-3, kSpacing = 4e-3, kGap = 0.3 * kSpacing;

/// Two cubes a third of a spacing apart, each held by its base; tops and sides lie in one plane.
class TwoCubesTouched : public testing::Test {
 protected:
  void SetUp() override {
    const Formulation& galerkin = galerkin_formulation();
    const ShapeFunctions fields = galerkin.fields(body.surface, body.cloud);
    ASSERT_NE(fields.true_neighbours(), nullptr);
    places = place_on_surface(body.surface, fields).value();
    touch = touchable_part(places, [](const Vec3& x) { return x.z() > -0.2 * kEdge; }).value();
    drawn = carry_surface(body.surface, places);
  }
  static bool is_first(const Vec3& x) { return x.x() < 0.5 * kGap; }

  test::Body body =
      test::placed_body(test::two_cubes(kEdge, kGap, 5), [](const Vec3&) { return kSpacing; });
  IsotropicMaterial material{5e3, 0.45};
  SurfacePlaces places;
  TouchableSurface touch;
  DrawnSurface drawn;
};

TEST_F(TwoCubesTouched, HavePlacesOnTheirSurfaceAndOnOneSideEach) {
  ASSERT_NE(places.paths, nullptr);
  EXPECT_GT(places.nodes, body.cloud.size());
  double first = 0.0;
  for (std::size_t p = 0; p < places.size(); ++p) {
    const double x = places.positions[p].x();
    EXPECT_TRUE(x < 1e-9 || x > kGap - 1e-9) << 1e3 * x << " mm";
    if (is_first(places.positions[p])) first += places.areas[p];
  }
  EXPECT_NEAR(first, 6.0 * kEdge * kEdge, 1e-9);
}

TEST_F(TwoCubesTouched, CarryTheirOwnVerticesAlone) {
  for (std::size_t v = 0; v < body.surface.vertices.size(); ++v)
    for (int e = drawn.carriers.row_begin[v]; e < drawn.carriers.row_begin[v + 1]; ++e) {
      const auto place =
          static_cast<std::size_t>(drawn.carriers.nodes[static_cast<std::size_t>(e)]);
      EXPECT_EQ(is_first(body.surface.vertices[v]), is_first(places.positions[place]));
    }
}

TEST_F(TwoCubesTouched, KeepALoadAtTheRimOnItsCube) {
  std::vector<LoadShare> shares;
  const Vec3 rim(-0.5e-3, 0.0, 0.5 * kEdge);
  ASSERT_TRUE(
      spread_load(touch, rim, Vec3::UnitZ(), PatchContact::spread_factor() * kSpacing, shares));
  EXPECT_GT(shares.size(), 5u);
  for (const LoadShare& share : shares)
    EXPECT_TRUE(is_first(touch.positions[static_cast<std::size_t>(share.place)]));
}

TEST_F(TwoCubesTouched, DoNotFeelEachOtherUnderATool) {
  auto solver = galerkin_formulation().prepare(
      body.problem(material, [](const Vec3& x) { return x.z() < -0.5 * kEdge + 1e-9; }),
      no_progress());
  ASSERT_TRUE(solver) << solver.error().text();
  const auto compliance = (*solver)->compliance(places.fields, touch.places, no_progress());
  ASSERT_TRUE(compliance) << compliance.error().text();
  PatchContact contact(*compliance, touch, material);
  contact.draw_on(drawn, nullptr);

  // One cell held 1 mm down at the first cube's rim; a second one rests on the other's, just over
  // the gap.
  const auto cell = [](double x, double depth) {
    ContactCell one;
    one.position = Vec3(x, 0.0, 0.5 * kEdge);
    one.normal = Vec3::UnitZ();
    one.direction = -Vec3::UnitZ();
    one.area = 1e-6;
    one.held = true;
    one.displacement = Vec3(0.0, 0.0, -depth);
    return one;
  };
  const std::vector<ContactCell> cells{cell(-0.5e-3, 1e-3), cell(kGap + 0.5e-3, 0.0)};
  ContactSolution solution;
  ContactResponse response;
  contact.solve(cells, solution, response);
  ASSERT_TRUE(solution.converged);
  EXPECT_GT(solution.forces[0].norm(), 1e-4);
  EXPECT_LT(solution.forces[1].norm(), 1e-6 * solution.forces[0].norm());

  std::vector<float> displacements;
  std::vector<Vec3f> positions;
  contact.place_displacements(response, displacements);
  contact.draw(displacements, cells, solution, positions);
  double first = 0.0, other = 0.0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const double moved = (positions[v].cast<double>() - body.surface.vertices[v]).norm();
    double& greatest = is_first(body.surface.vertices[v]) ? first : other;
    greatest = std::max(greatest, moved);
  }
  EXPECT_GT(first, 1e-4);
  EXPECT_LT(other, 1e-8);  // single precision of positions
}

}  // namespace
}  // namespace viscera
