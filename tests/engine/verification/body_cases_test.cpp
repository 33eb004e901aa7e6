// The bodies that decide, and their references.
#include "engine/verification/body_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <numbers>

#include "engine/verification/body_references.h"
#include "engine/verification/thick_sphere.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

const BodyCase& body_named(const std::string& name) {
  for (const BodyCase& body : body_cases())
    if (body.name == name) return body;
  ADD_FAILURE() << name;
  return body_cases().front();
}

/// Every edge belongs to two triangles that run along it in opposite ways.
bool is_closed(const TriangleSurface& surface) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  return std::ranges::all_of(edges, [&](const auto& edge) {
    const auto other = edges.find({edge.first.second, edge.first.first});
    return edge.second == 1 && other != edges.end() && other->second == 1;
  });
}

TEST(BodyCases, SurfacesAreClosedAndEncloseTheirBody) {
  const double ball = 1.0 / 0.3;
  const std::map<std::string, double> volumes = {
      {"ball", 4.0 / 3.0 * std::numbers::pi * ball * ball * ball},
      {"slab_2", 128.0 * std::numbers::pi},
      {"slab_3.5", 224.0 * std::numbers::pi},
      {"slab_5", 320.0 * std::numbers::pi},
      {"edge_1.2", 864.0},
      {"edge_2", 864.0},
      {"edge_4", 864.0},
      {"bar", 256.0}};
  ASSERT_EQ(body_cases().size(), volumes.size());
  for (const BodyCase& body : body_cases()) {
    EXPECT_TRUE(is_closed(body.surface)) << body.name;
    // Circles are polygons of some fifty sides.
    EXPECT_NEAR(volume(body.surface) / volumes.at(body.name), 1.0, 0.01) << body.name;
  }
  const TriangleSurface hollow = hollow_sphere(0.4, 1.0, 0.1);
  EXPECT_TRUE(is_closed(hollow));
  EXPECT_NEAR(volume(hollow) / (4.0 / 3.0 * std::numbers::pi * (1.0 - 0.064)), 1.0, 0.01);
}

TEST(BodyCases, ContactsLieOnTheBodyAtTheirDistanceFromTheEdge) {
  for (const auto& [name, edge] :
       {std::pair{"edge_1.2", 1.2}, std::pair{"edge_2", 2.0}, std::pair{"edge_4", 4.0}}) {
    const BodyCase& body = body_named(name);
    double right = 0.0;
    for (const Vec3& x : body.surface.vertices) right = std::max(right, x.x());
    EXPECT_NEAR(right, edge, 1e-12);
    const auto cells = cells_of(body, BodyLoad::kFlat, 0.45);
    ASSERT_EQ(cells.size(), 127u);
    for (const ContactCell& cell : cells) {
      EXPECT_LT(cell.position.x(), edge * kBodyUnit);
      EXPECT_EQ(cell.position.z(), 0.0);
    }
  }
}

class BodyReferences : public testing::Test {
 protected:
  static const std::vector<KnownBodyReference>& known() {
    static const auto all =
        read_body_references(test::project_file("assets/reference/bodies")).value();
    return all;
  }
};

TEST_F(BodyReferences, HoldEveryBodyLoadAndPoissonRatio) {
  for (const BodyCase& body : body_cases())
    for (const BodyLoad load : body.loads)
      for (const double nu : kBodyPoissonRatios) {
        const BodyReference* one = find_reference(known(), body.name, load, nu);
        ASSERT_TRUE(one) << body.name << ' ' << name_of(load) << ' ' << nu;
        EXPECT_GT(one->samples.size(), 30u);
        for (const BodyReference::Sample& sample : one->samples) {
          EXPECT_GE(sample.weight, 0.0);
          const double across = std::hypot(sample.place.x(), sample.place.y());
          const bool on_top = body.cap > 0.0 || sample.place.z() > -1e-6;
          if ((load == BodyLoad::kStick || load == BodyLoad::kFlat) && across < 0.999 && on_top &&
              sample.place.z() > -0.5) {
            EXPECT_NEAR(sample.displacement.z(), -depth_of(body, load), 1e-4);
          }
        }
        if (load == BodyLoad::kPress) {
          EXPECT_NEAR(one->force, std::numbers::pi / 3.0, 1e-4);
        }
      }
  EXPECT_FALSE(find_reference(known(), "slab_2", BodyLoad::kFlat, 0.4));
  EXPECT_FALSE(find_reference(known(), "slab_2", BodyLoad::kPlate, 0.45));
}

TEST_F(BodyReferences, DifferFromTheHalfSpaceWhereTheBodyDecides) {
  const auto share = [&](const std::string& body, BodyLoad load) {
    return find_reference(known(), body, load, 0.45)->force /
           half_space_force(body_named(body), load, 0.45);
  };
  EXPECT_GT(share("slab_2", BodyLoad::kFlat), 1.7);
  EXPECT_GT(share("slab_5", BodyLoad::kBall), 1.2);
  EXPECT_LT(share("ball", BodyLoad::kPlate), 0.75);
  EXPECT_LT(share("bar", BodyLoad::kStick), 0.05);
  // The nearer the edge, the softer.
  EXPECT_LT(share("edge_1.2", BodyLoad::kFlat), 0.9 * share("edge_2", BodyLoad::kFlat));
  EXPECT_LT(share("edge_2", BodyLoad::kFlat), 0.95 * share("edge_4", BodyLoad::kFlat));
}

TEST_F(BodyReferences, AreWhatFiniteElementsGiveAgain) {
  for (const auto& [name, load, tolerance] :
       {std::tuple{"slab_2", BodyLoad::kFlat, 5e-3}, std::tuple{"slab_3.5", BodyLoad::kBall, 5e-3},
        std::tuple{"ball", BodyLoad::kStick, 5e-3},
        // Coarse in three dimensions, to be quick; stiffer therefore.
        std::tuple{"edge_2", BodyLoad::kFlat, 0.03}, std::tuple{"bar", BodyLoad::kStick, 0.03}}) {
    const auto again = body_named(name).reference(load, 0.45, -1);
    ASSERT_TRUE(again) << again.error().text();
    EXPECT_NEAR(again->force / find_reference(known(), name, load, 0.45)->force, 1.0, tolerance)
        << name;
  }
}

TEST_F(BodyReferences, ReadBackAsTheyAreWritten) {
  const test::TemporaryFolder folder;
  for (const auto& [name, text] : body_reference_files(known()))
    std::ofstream(folder / name) << text;
  const auto again = read_body_references(folder.path());
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(body_reference_files(*again), body_reference_files(known()));
}

TEST(BodyReferenceFiles, NameTheFileAndLineOfABrokenTable) {
  const test::TemporaryFolder folder;
  const auto said = [&] {
    const auto read = read_body_references(folder.path());
    return read ? std::string() : read.error().text();
  };
  EXPECT_NE(said().find("forces.csv: can't be read"), std::string::npos) << said();
  std::ofstream(folder / "forces.csv") << "body,load,poisson,force\nslab_2,glue,0.45,1\n";
  EXPECT_NE(said().find("forces.csv:2: found \"slab_2,glue,0.45,1\""), std::string::npos) << said();
  std::ofstream(folder / "forces.csv") << "body,load,poisson,force\nslab_2,flat,0.45,1\n";
  EXPECT_NE(said().find("slab_2_flat.csv: can't be read"), std::string::npos) << said();
  std::ofstream(folder / "slab_2_flat.csv") << "poisson,x,y,z,ux,uy,uz,weight\n0.3,0,0,0,0,0,0,1\n";
  EXPECT_NE(said().find("no row of Poisson's ratio 0.45"), std::string::npos) << said();
}

TEST(PressedBodies, PinningWithoutANodeInsideHasNoAnswer) {
  const BodyCase& slab = body_named("slab_2");
  const auto body = prepare_body(slab, 0.3, 250, "galerkin", no_progress());
  ASSERT_TRUE(body) << body.error().text();
  EXPECT_FALSE((*body)->pin([](const Vec3&) { return false; }, Vec3(0, 0, -1e-4)).converged);
  const auto pinned = (*body)->pin(
      [](const Vec3& x) { return x.head<2>().norm() < 2.0 * kBodyUnit; }, Vec3(0, 0, -1e-4));
  ASSERT_TRUE(pinned.converged);
  EXPECT_LT(pinned.force.z(), 0.0);
}

TEST(PressedBodies, PinningMovesThePinnedPlacesWhereComplianceIsntSymmetric) {
  const BodyCase& slab = body_named("slab_5");
  const auto body = prepare_body(slab, 0.3, 500, "gfdm", no_progress());
  if (!body) GTEST_SKIP() << body.error().text();
  const auto pinned = (*body)->pin(
      [](const Vec3& x) { return x.head<2>().norm() < 2.5 * kBodyUnit; }, Vec3(0, 0, -1e-4));
  ASSERT_TRUE(pinned.converged);
  EXPECT_LT(pinned.force.z(), 0.0);
}

}  // namespace
}  // namespace viscera
