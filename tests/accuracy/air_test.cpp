#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "kernels/paff/true_neighbours.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/blocks.h"

namespace viscera {
namespace {

double env(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atof(text) : otherwise;
}

TEST(Air, Leaves) {
  const double gap = env("GAP", 0.6e-3), root = env("ROOT", 2e-3), h = env("H", 2e-3);
  const double nu = env("NU", 0.3);
  const test::Body body = test::placed_body(test::leaves({40e-3, 10e-3, 4e-3}, gap, root, env("STEP", 2e-3)),
                                            [h](const Vec3&) { return h; });
  const IsotropicMaterial material{1e4, nu};
  const bool back_only = env("BACK", 0) > 0;
  auto system = GalerkinSystem::assemble(
      body.problem(material, [&](const Vec3& x) { return back_only ? x.x() < -root + 1e-9 : x.x() < 1e-9; }), 1.8,
      no_progress());
  ASSERT_TRUE(system) << system.error().text();
  std::printf("nodes %zu twins %zu points %zu correction %.4f assemble %.2f s pieces %zu\n", body.cloud.size(),
              system->figures().twins, system->figures().quadrature_points,
              system->figures().gradient_correction, system->figures().assemble_s, system->pieces().size());
  {
    int inair = 0, ties = 0, shown = 0;
    const auto& volume = system->volume();
    ShapeValues at;
    const auto* tn = system->fields().true_neighbours().get();
    for (std::size_t q = 0; q < volume.size(); ++q) {
      const Vec3& x = volume.positions[q];
      if (x.x() > 0 && std::abs(x.z()) < 0.5 * gap) {
        ++inair;
        if (shown++ < 5) std::printf("air %g %g %g w %g\n", x.x()*1e3, x.y()*1e3, x.z()*1e3, volume.weights[q]*1e9);
      }
      if (x.x() < 5e-3) continue;
      system->fields().evaluate(x, false, at);
      for (std::size_t j = 0; j < at.nodes.size(); ++j) {
        std::size_t node = static_cast<std::size_t>(at.nodes[j]);
        const bool twin = node >= body.cloud.size();
        const Vec3& p = system->fields().cloud().positions[node];
        if ((p.z() * x.z() < 0) != twin && std::abs(at.values[j]) > 1e-12) {
          if (ties++ < 8) {
            std::printf("tie node %zu twin %d at %g %g %g to %g %g %g value %g weight %g straight %d\n", node, twin, p.x()*1e3, p.y()*1e3, p.z()*1e3, x.x()*1e3, x.y()*1e3, x.z()*1e3, at.values[j], at.weights[j], tn->paths().straight(p, x));
          }
        }
      }
    }
    std::printf("in air %d ties %d\n", inair, ties);
  }
  const double area = 10e-3 * 4e-3;
  const auto unknowns = system->solve(
      {.body_force = {},
       .traction = [&](const Vec3& x, const Vec3& n) -> Vec3 {
         if (n.x() > 0.9 && x.x() > 39e-3 && x.z() > 0) return Vec3(0, 0, 1e-4 / area);
         return Vec3(Vec3::Zero());
       },
       .held_displacement = {}});
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  const Vec3 loaded = system->displacement(*unknowns, Vec3(40e-3, 0, 0.5 * gap + 2e-3));
  const Vec3 other = system->displacement(*unknowns, Vec3(40e-3, 0, -0.5 * gap - 2e-3));
  const Vec3 start = system->displacement(*unknowns, Vec3(0, 0, 0.5 * gap + 2e-3));
  std::printf("tip %.4f mm, other %.5f mm, start %.4f\n", 1e3 * loaded.z(), 1e3 * other.z(), 1e3 * start.z());
}

}  // namespace
}  // namespace viscera
