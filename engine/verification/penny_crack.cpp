#include "engine/verification/penny_crack.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/verification/brick_surface.h"
#include "kernels/base/stopwatch.h"
#include "kernels/paff/galerkin.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

constexpr double kGap = 0.02e-3;  // between its faces before it opens [m]
constexpr double kSupport = 1.8;  // of the fields, in spacings
constexpr int kDirections = 8;

/// Its faces and its rim, oriented into the crack: out of the body. About z = 0.
TriangleSurface faces(const PennyCrack& crack) {
  const int rings = static_cast<int>(std::ceil(crack.radius / (0.5 * crack.spacing)));
  const int around = static_cast<int>(std::ceil(2.0 * std::numbers::pi * rings));
  TriangleSurface surface;
  const auto add_face = [&](double z) {
    const int centre = static_cast<int>(surface.vertices.size());
    surface.vertices.emplace_back(0.0, 0.0, z);
    for (int ring = 1; ring <= rings; ++ring)
      for (int k = 0; k < around; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / around, r = crack.radius * ring / rings;
        surface.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
      }
    return centre;
  };
  const int low = add_face(-0.5 * kGap), high = add_face(0.5 * kGap);
  const auto vertex = [&](int face, int ring, int k) {
    return ring == 0 ? face : face + 1 + (ring - 1) * around + k % around;
  };
  const auto add = [&](int a, int b, int c) { surface.triangles.push_back({a, b, c}); };
  for (int k = 0; k < around; ++k) {
    for (int ring = 0; ring < rings; ++ring) {
      // The lower face looks up, into the crack; the upper one down.
      const int a = vertex(low, ring, k), b = vertex(low, ring + 1, k),
                c = vertex(low, ring + 1, k + 1), d = vertex(low, ring, k + 1);
      add(a, b, c);
      if (ring > 0) add(a, c, d);
      const int up = high - low;
      add(a + up, c + up, b + up);
      if (ring > 0) add(a + up, d + up, c + up);
    }
    const int a = vertex(low, rings, k), b = vertex(low, rings, k + 1), c = vertex(high, rings, k),
              d = vertex(high, rings, k + 1);
    add(a, c, b);
    add(b, c, d);
  }
  return surface;
}

}  // namespace

double PennyCrack::exact_opening(double r) const {
  const double nu = material.poisson_ratio;
  return 8.0 * (1.0 - nu * nu) * pressure * std::sqrt(std::max(0.0, radius * radius - r * r)) /
         (std::numbers::pi * material.youngs_modulus);
}

Result<OpenedCrack> open_crack(const PennyCrack& crack) {
  const Stopwatch watch;
  const std::vector<double> across = lines(-crack.half, crack.half, crack.coarse);
  const TriangleSurface whole = bricks(across, across, across, [](const Vec3&) { return true; });
  const TriangleSurface inner = faces(crack);
  TriangleSurface surface = whole;
  const int first = static_cast<int>(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& t : inner.triangles)
    surface.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  NodePlacement placement;
  placement.seed = crack.seed;
  // Nodes as without the crack.
  auto cloud = place_nodes(whole, SurfaceTree(whole),
                           graded_spacing(crack.coarse, crack.spacing, 0.25, inner.vertices),
                           placement, no_progress());
  if (!cloud) return std::unexpected(cloud.error());
  const double outside = crack.half - 1e-9;
  ElasticProblem problem{&surface, &*cloud, crack.material,
                         [&](const Vec3& x) { return x.cwiseAbs().maxCoeff() > outside; }};
  auto system = GalerkinSystem::assemble(problem, kSupport, no_progress());
  if (!system) return std::unexpected(system.error());
  StaticLoads loads;
  loads.traction = [&](const Vec3&, const Vec3& normal) { return Vec3(-crack.pressure * normal); };
  auto moved = system->solve(loads);
  if (!moved) return std::unexpected(moved.error());
  OpenedCrack opened;
  for (int ring = 0; ring <= 9; ++ring) {
    const double r = 0.1 * ring * crack.radius;
    double sum = 0.0;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / kDirections;
      const Vec3 at(r * std::cos(angle), r * std::sin(angle), 0.0), up(0.0, 0.0, 0.5 * kGap + 1e-7);
      sum += (system->displacement(*moved, at + up) - system->displacement(*moved, at - up)).z();
    }
    opened.openings.push_back({r, sum / kDirections});
  }
  opened.nodes = cloud->size();
  opened.twins = system->figures().twins;
  opened.seconds = watch.seconds();
  return opened;
}

}  // namespace viscera
