// A hemisphere on its flat base under a smooth pressure about the pole, against a converged
// axisymmetric solution (assets/reference/hemisphere/README.md).
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

/// Unit hemisphere above z = 0, closed by its base: an octahedron whose faces are split n ways, the
/// upper ones blown up to the sphere, the lower ones flattened to the disc.
TriangleSurface hemisphere(int n) {
  TriangleSurface surface;
  std::map<std::array<int, 3>, int> vertex_at;
  const auto vertex = [&](int x, int y, int z) {
    const auto [entry, fresh] =
        vertex_at.try_emplace({x, y, z}, static_cast<int>(surface.vertices.size()));
    if (fresh) {
      Vec3 place(x, y, std::max(z, 0));
      const double share = static_cast<double>(std::abs(x) + std::abs(y) + std::max(z, 0)) / n;
      if (place.norm() > 0.0) place *= share / place.norm();
      surface.vertices.push_back(place);
    }
    return entry->second;
  };
  for (const int sz : {1, -1}) {
    for (const auto& [sx, sy] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
      const bool outward = sx * sy * sz > 0;
      const auto add = [&](std::array<int, 3> t) {
        if (!outward) std::swap(t[1], t[2]);
        surface.triangles.push_back(t);
      };
      for (int i = 0; i < n; ++i) {
        for (int j = 0; i + j < n; ++j) {
          const auto at = [&](int a, int b) { return vertex(sx * a, sy * b, sz * (n - a - b)); };
          add({at(i, j), at(i + 1, j), at(i, j + 1)});
          if (i + j + 1 < n) add({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
        }
      }
    }
  }
  return surface;
}

/// First data row of a reference file: axial displacement at the pole over R.
double reference_pole(const std::string& name) {
  std::ifstream file(test::project_file("assets/reference/hemisphere/" + name));
  std::string header;
  std::getline(file, header);
  double angle = 0.0, radial = 0.0, axial = 0.0;
  char comma = 0;
  file >> angle >> comma >> radial >> comma >> axial;
  return axial;
}

class PressedHemisphere : public testing::TestWithParam<std::pair<double, std::string>> {};

TEST_P(PressedHemisphere, PoleSinksAsInTheReference) {
  const auto& [poisson_ratio, file] = GetParam();
  const Vec3 pole(0.0, 0.0, 1.0);
  const test::Body body =
      test::placed_body(hemisphere(20), graded_spacing(0.15, 0.045, 0.25, {pole}));
  const auto system = GalerkinSystem::assemble(
      body.problem({1.0, poisson_ratio}, [](const Vec3& x) { return x.z() < 1e-9; }),
      galerkin_formulation().support_factor(), no_progress());
  ASSERT_TRUE(system) << system.error().text();

  constexpr double kPatch = 0.2;
  StaticLoads loads;
  loads.traction = [](const Vec3& x, const Vec3& n) {
    const double s2 = (x.x() * x.x() + x.y() * x.y()) / (kPatch * kPatch);
    return s2 < 1.0 ? Vec3(-(1.0 - s2) * (1.0 - s2) * n) : Vec3(Vec3::Zero());
  };
  const auto unknowns = system->solve(loads);
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  const double sunk = system->displacement(*unknowns, pole).z();
  const double reference = reference_pole(file);
  RecordProperty("nodes", std::to_string(body.cloud.size()));
  RecordProperty("error", std::to_string(sunk / reference - 1.0));
  EXPECT_NEAR(sunk / reference, 1.0, 0.04) << body.cloud.size() << " nodes";
}

INSTANTIATE_TEST_SUITE_P(Poisson, PressedHemisphere,
                         testing::Values(std::pair{0.30, "press_nu0.30_a0.2.csv"},
                                         std::pair{0.45, "press_nu0.45_a0.2.csv"}));

}  // namespace
}  // namespace viscera
