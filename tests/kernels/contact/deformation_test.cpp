#include "kernels/contact/deformation.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/kernels/contact/bodies.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

const IsotropicMaterial kTissue{1e4, 0.45};
constexpr double kTop = 0.01;
const Vec3 kEdges(0.03, 0.03, 2.0 * kTop);

/// A block and a fine drawn skin on it.
struct DrawnBlock {
  test::PressedBody body = test::prepare_block(kEdges, 3.5e-3, 0.012, kTissue);
  TriangleSurface skin = test::box(kEdges, 60);
  DrawnSurface drawn = carry_surface(skin, body.places);
};

const DrawnBlock& block() {
  static const DrawnBlock drawn;
  return drawn;
}

struct Pressed {
  std::vector<ContactCell> cells;
  ContactSolution solution;
  std::vector<float> displacements;
  std::vector<Vec3f> positions, normals;
};

Pressed press(std::vector<ContactCell> cells) {
  Pressed pressed;
  pressed.cells = std::move(cells);
  PatchContact contact(block().body.compliance, block().body.touch, kTissue);
  ContactResponse response;
  contact.solve(pressed.cells, pressed.solution, response);
  place_displacements(block().body.compliance, response, pressed.displacements);
  deform_drawn_surface(block().drawn, pressed.displacements, pressed.solution.near_fields,
                       pressed.cells, pressed.solution.forces, pressed.positions, pressed.normals);
  return pressed;
}

TEST(Deformation, DisplacementsAreTheComplianceTimesTheLoads) {
  const SurfaceCompliance& compliance = block().body.compliance;
  ASSERT_GT(compliance.touchable.size(), 8u);
  ContactResponse response;
  response.touched = {1, 4, 7};
  response.loads = {Vec3(1, 2, 3), Vec3(-1, 0.5, 0), Vec3(0, 0, -2)};
  std::vector<float> displacements;
  place_displacements(compliance, response, displacements);
  ASSERT_EQ(displacements.size(), compliance.rows());
  for (std::size_t row = 0; row < compliance.rows(); row += 17) {
    double expected = 0.0, size = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      for (int a = 0; a < 3; ++a) {
        const std::size_t column =
            3 * static_cast<std::size_t>(response.touched[j]) + static_cast<std::size_t>(a);
        const double term =
            compliance.columns[column * compliance.rows() + row] * response.loads[j][a];
        expected += term;
        size += std::abs(term);
      }
    }
    EXPECT_NEAR(displacements[row], expected, 1e-5 * size);
  }
}

TEST(Deformation, SkinUnderAFlatPunchGoesDownWithIt) {
  const double depth = 0.5e-3;
  const Pressed pressed =
      press(test::plane_cells(Vec3(0.7e-3, -0.4e-3, kTop), 0.25e-3, 7, 0.0, depth));
  ASSERT_TRUE(pressed.solution.converged);
  int under = 0;
  for (std::size_t v = 0; v < block().skin.vertices.size(); ++v) {
    const Vec3& rest = block().skin.vertices[v];
    if (rest.z() < kTop - 1e-9) continue;
    const double r = (rest - Vec3(0.7e-3, -0.4e-3, kTop)).norm();
    const double down = kTop - pressed.positions[v].z();
    if (r < 1.2e-3) {
      EXPECT_NEAR(down, depth, 0.05 * depth) << "at " << r;
      ++under;
    }
    // Sneddon outside the punch (half-space; the block is finite).
    if (r > 2.5e-3 && r < 6e-3) {
      EXPECT_NEAR(down, 2.0 * depth / std::numbers::pi * std::asin(1.8e-3 / r), 0.08 * depth)
          << "at " << r;
    }
  }
  EXPECT_GT(under, 10);
}

TEST(Deformation, RestIsDrawnWhereItIs) {
  const Pressed pressed = press(test::plane_cells(Vec3(0, 0, kTop), 0.25e-3, 3, 1e-3, -1e-3));
  const std::vector<Vec3> normals = vertex_normals(block().skin);
  for (std::size_t v = 0; v < block().skin.vertices.size(); ++v) {
    EXPECT_EQ(pressed.positions[v], block().skin.vertices[v].cast<float>());
    EXPECT_LT((pressed.normals[v].cast<double>() - normals[v]).norm(), 1e-3);
  }
}

TEST(Deformation, NormalsAreUnitAndLeanTowardsThePit) {
  const Pressed pressed = press(test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, 0.6e-3));
  for (std::size_t v = 0; v < pressed.normals.size(); ++v) {
    EXPECT_NEAR(pressed.normals[v].norm(), 1.0f, 1e-5f);
    const Vec3& rest = block().skin.vertices[v];
    if (rest.z() > kTop - 1e-9 && std::abs(rest.x() - 1.5e-3) < 1e-9 && std::abs(rest.y()) < 1e-9) {
      EXPECT_LT(pressed.normals[v].x(), -0.05f);
    }
  }
}

TEST(Deformation, NearFieldAloneIsWhatIsAddedToTheCarriedDisplacements) {
  const Pressed pressed = press(test::plane_cells(Vec3(0, 0, kTop), 0.26e-3, 3, 1e-3, 0.6e-3));
  std::vector<Vec3f> carried, normals;
  deform_drawn_surface(block().drawn, pressed.displacements, {}, {}, {}, carried, normals);
  std::vector<int> vertices;
  std::vector<Vec3f> near;
  near_field_on_surface(block().drawn, pressed.solution.near_fields, pressed.cells,
                        pressed.solution.forces, vertices, near);
  ASSERT_EQ(vertices.size(), near.size());
  EXPECT_GT(vertices.size(), 10u);
  EXPECT_LT(vertices.size(), carried.size() / 2);
  EXPECT_TRUE(std::is_sorted(vertices.begin(), vertices.end()));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    carried[static_cast<std::size_t>(vertices[i])] += near[i];
  }
  for (std::size_t v = 0; v < carried.size(); ++v) {
    EXPECT_LT((carried[v] - pressed.positions[v]).norm(), 1e-8f);
  }
  near_field_on_surface(block().drawn, {}, {}, {}, vertices, near);
  EXPECT_TRUE(vertices.empty() && near.empty());
}

TEST(Deformation, SameDigitsForAnyNumberOfThreads) {
  const auto cells = test::plane_cells(Vec3(1e-3, 0, kTop), 0.26e-3, 3, 1e-3, 0.6e-3);
  const Pressed many = press(cells);
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  const Pressed single = press(cells);
  EXPECT_EQ(many.displacements, single.displacements);
  EXPECT_EQ(many.positions, single.positions);
  EXPECT_EQ(many.normals, single.normals);
}

}  // namespace
}  // namespace viscera
