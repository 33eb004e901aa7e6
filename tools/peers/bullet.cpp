#include "tools/peers/bullet.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <fstream>

#include "engine/io/atomic_file.h"
#include "engine/verification/hemisphere_body.h"
#include "kernels/paff/elasticity.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace fs = std::filesystem;

fs::path bullet_program() {
  const fs::path program = program_folder() / "viscera_bullet";
  std::error_code error;
  return fs::exists(program, error) ? program : fs::path();
}

std::vector<Vec3> internal_forces(const TetrahedralMesh& mesh, double poisson_ratio,
                                  const std::vector<Vec3>& displacements) {
  const IsotropicMaterial material{1.0, poisson_ratio};
  std::vector<Vec3> forces(mesh.nodes.size(), Vec3::Zero());
  for (const auto& element : mesh.elements) {
    Mat3 edges, moved;
    const auto at = [&](const std::vector<Vec3>& values, std::size_t i) {
      return values[static_cast<std::size_t>(element[i])];
    };
    for (int i = 0; i < 3; ++i) {
      edges.col(i) = at(mesh.nodes, static_cast<std::size_t>(i + 1)) - at(mesh.nodes, 0);
      moved.col(i) = at(displacements, static_cast<std::size_t>(i + 1)) - at(displacements, 0);
    }
    const Mat3 inverse = edges.inverse();
    const Mat3 gradient = moved * inverse;
    const Mat3 stress = material.lame_lambda() * gradient.trace() * Mat3::Identity() +
                        material.shear_modulus() * (gradient + gradient.transpose());
    const double volume = std::abs(edges.determinant()) / 6.0;
    Vec3 rest = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      const Vec3 force = volume * stress * inverse.row(i).transpose();
      forces[static_cast<std::size_t>(element[static_cast<std::size_t>(i + 1)])] += force;
      rest -= force;
    }
    forces[static_cast<std::size_t>(element[0])] += rest;
  }
  return forces;
}

Result<BulletAnswer> step_bullet(const TetrahedralMesh& mesh, double poisson_ratio, double a_over_R,
                                 BulletElasticity elasticity, int steps, const fs::path& folder) {
  std::string text =
      fmt::format("{} {} {} {} {}\n{}\n", kHemisphereModulus, poisson_ratio,
                  kHemisphereDepth * kHemisphereRadius, steps,
                  elasticity == BulletElasticity::kLinear ? 1 : 0, mesh.nodes.size());
  for (const Vec3& node : mesh.nodes) {
    const Vec3 x = kHemisphereRadius * node;
    text += fmt::format("{:.9e} {:.9e} {:.9e}\n", x.x(), x.y(), x.z());
  }
  text += fmt::format("{}\n", mesh.elements.size());
  for (const auto& element : mesh.elements)
    text += fmt::format("{} {} {} {}\n", element[0], element[1], element[2], element[3]);
  const std::vector<int> patch = patch_nodes(mesh, a_over_R);
  for (const auto& nodes : {base_nodes(mesh), patch}) {
    text += fmt::format("{}\n{}\n", nodes.size(), fmt::join(nodes, " "));
  }
  if (auto written = write_file(folder / "bullet.in", text); !written)
    return std::unexpected(written.error());
  const CommandResult done = run_program({bullet_program().string(), "bullet.in", "bullet.out"},
                                         folder / "bullet.log", folder);
  if (done.code != 0) return failure(fmt::format("Bullet failed with code {}", done.code));

  BulletAnswer answer;
  std::ifstream file(folder / "bullet.out");
  file >> answer.step_s >> answer.rest_s >> answer.setup_s;
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    Vec3 u;
    file >> u[0] >> u[1] >> u[2];
    answer.displacements.push_back(u / kHemisphereRadius);
  }
  if (!file) return failure("Bullet's body: found displacements that aren't numbers");
  const auto forces = internal_forces(mesh, poisson_ratio, answer.displacements);
  for (const int node : patch)
    answer.force_over_ERdelta -= forces[static_cast<std::size_t>(node)].z() / kHemisphereDepth;
  return answer;
}

}  // namespace viscera
