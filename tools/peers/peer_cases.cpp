#include "tools/peers/peer_cases.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <ostream>

#include "engine/io/interrupt.h"
#include "kernels/base/progress.h"
#include "tools/common/bench_figures.h"
#include "tools/peers/bullet.h"
#include "tools/peers/finite_elements.h"

namespace viscera {
namespace {

struct Mesh {
  MeshOptions options;
  std::string variant;
  bool quick;  ///< in the quick run too
};

/// About 500 to 10,000 nodes; graded meshes are finest within 0.3 R of the pole.
std::vector<Mesh> meshes() {
  return {{{false, 0.13, 0.0}, "uniform", true},   {{false, 0.09, 0.0}, "uniform", false},
          {{false, 0.06, 0.0}, "uniform", false},  {{false, 0.055, 0.25}, "graded", true},
          {{false, 0.035, 0.25}, "graded", false}, {{false, 0.022, 0.25}, "graded", false},
          {{true, 0.30, 0.0}, "uniform", true},    {{true, 0.22, 0.0}, "uniform", false},
          {{true, 0.15, 0.0}, "uniform", false},   {{true, 0.13, 0.25}, "graded", true},
          {{true, 0.08, 0.25}, "graded", false},   {{true, 0.045, 0.25}, "graded", false}};
}

HemisphereCase empty_case(const TetrahedralMesh& mesh, double poisson_ratio, double a_over_R) {
  HemisphereCase one;
  one.basis = mesh.quadratic ? "quadratic" : "linear";
  one.nodes = mesh.nodes.size();
  one.surface_nodes = mesh.surface_nodes;
  one.poisson = poisson_ratio;
  one.a_over_R = a_over_R;
  one.contact = name_of(HemisphereContact::kStick);
  one.cells = patch_nodes(mesh, a_over_R).size();
  return one;
}

void set_errors(HemisphereCase& one, const TetrahedralMesh& mesh, double force,
                const std::vector<Vec3>& displacements,
                const std::vector<HemisphereReference>& references) {
  one.force_over_ERdelta = force;
  const HemisphereReference* reference = find_reference(references, one.poisson, one.a_over_R);
  if (!reference) return;
  one.force_error = force / reference->stick - 1.0;
  one.profile_error =
      dome_error(mesh, displacements, reference->profile(HemisphereContact::kStick));
}

std::vector<HemisphereCase> finite_element_cases(const TetrahedralMesh& mesh, double nu, double a,
                                                 const std::string& variant, bool fitted,
                                                 const std::vector<HemisphereReference>& references,
                                                 const std::filesystem::path& folder,
                                                 std::ostream& out) {
  std::vector<HemisphereCase> both;
  for (const CalculixSolver solver :
       {CalculixSolver::kSpooles, CalculixSolver::kIterativeCholesky}) {
    const auto answer = solve_calculix(mesh, nu, a, solver, folder);
    if (!answer) {
      out << "peers: " << answer.error().text() << '\n';
      continue;
    }
    HemisphereCase one = empty_case(mesh, nu, a);
    one.formulation = mesh.quadratic ? "calculix_t10" : "calculix_t4";
    one.variant = variant;
    one.note = fmt::format("{}; every load is solved afresh",
                           solver == CalculixSolver::kSpooles ? "SPOOLES" : "iterative Cholesky");
    one.prepare_s = mesh.mesh_s;
    one.prepares = "the mesh";
    one.online_us = 1e6 * answer->process_s;
    if (answer->own_s) one.own_us = 1e6 * *answer->own_s;
    one.memory_bytes = answer->peak_memory_bytes;
    one.in_plots = fitted;
    set_errors(one, mesh, answer->force_over_ERdelta, answer->displacements, references);
    both.push_back(std::move(one));
  }
  // Plots show the faster of the two solvers.
  if (both.size() == 2)
    both[first_answer_s(both[0]) > first_answer_s(both[1]) ? 0 : 1].in_plots = false;
  return both;
}

/// Corotated, as Bullet has it, and linear, as the reference is.
std::vector<HemisphereCase> bullet_cases(const TetrahedralMesh& mesh, double nu, double a,
                                         const std::string& variant, bool fitted, bool quick,
                                         const std::vector<HemisphereReference>& references,
                                         const std::filesystem::path& folder, std::ostream& out) {
  std::vector<HemisphereCase> both;
  for (const BulletElasticity elasticity :
       {BulletElasticity::kLinear, BulletElasticity::kCorotated}) {
    const auto stepped = step_bullet(mesh, nu, a, elasticity, quick ? 60 : 300, folder);
    if (!stepped) {
      out << "peers: " << stepped.error().text() << '\n';
      continue;
    }
    const bool linear = elasticity == BulletElasticity::kLinear;
    HemisphereCase one = empty_case(mesh, nu, a);
    one.formulation = linear ? "bullet_linear" : "bullet";
    one.variant = variant;
    one.note = fmt::format(
        "{}; a step of 1/60 s; error after coming to rest; force by linear "
        "tetrahedra",
        linear ? "linear as the reference" : "corotated: it isn't linear");
    one.prepare_s = mesh.mesh_s + stepped->setup_s;
    one.prepares = "the body";
    one.online_us = 1e6 * stepped->step_s;
    one.more_s = stepped->rest_s;
    one.in_plots = fitted;
    set_errors(one, mesh, stepped->force_over_ERdelta, stepped->displacements, references);
    both.push_back(std::move(one));
  }
  return both;
}

}  // namespace

Result<void> measure_peers(const std::vector<double>& poisson_ratios,
                           const std::vector<double>& radii, bool quick,
                           const std::vector<HemisphereReference>& references,
                           const std::function<void(HemisphereCase)>& add, std::ostream& out) {
  if (!finite_elements_installed()) {
    out << "peers: gmsh and CalculiX aren't installed (tools/setup --peers); left out\n";
    return {};
  }
  const bool has_bullet = !bullet_program().empty();
  if (!has_bullet)
    out << "peers: Bullet wasn't installed when this was built (tools/setup --peers); left out\n";
  auto scratch = ScratchFolder::create();
  if (!scratch) return std::unexpected(scratch.error());
  const auto& folder = (*scratch)->path();
  out << "peers prepare a mesh, which serves all radii where it knows nothing of the contact "
         "(\"pinned\"), and solve each load afresh; \"own us\" is what CalculiX itself says of a "
         "further solution, \"one load us\" the whole process, for Bullet a step\n";
  for (const Mesh& kind : meshes()) {
    if (quick && !kind.quick) continue;
    for (const double a : radii) {
      for (const bool fitted : {true, false}) {
        MeshOptions options = kind.options;
        options.contact = fitted ? a : 0.0;
        const auto mesh = mesh_hemisphere(options, folder);
        if (!mesh) {
          out << "peers: " << mesh.error().text() << '\n';
          continue;
        }
        const std::string variant =
            fmt::format("{}{}", kind.variant, fitted ? " fitted" : " pinned");
        for (const double nu : poisson_ratios) {
          if (interrupted()) return failure(kCancelled);
          for (HemisphereCase& one :
               finite_element_cases(*mesh, nu, a, variant, fitted, references, folder, out))
            add(std::move(one));
          if (!has_bullet || mesh->quadratic || mesh->nodes.size() > 2000) continue;
          for (HemisphereCase& one :
               bullet_cases(*mesh, nu, a, variant, fitted, quick, references, folder, out))
            add(std::move(one));
        }
      }
    }
  }
  return {};
}

}  // namespace viscera
