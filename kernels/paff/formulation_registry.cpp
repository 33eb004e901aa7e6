#include <array>

#include "kernels/paff/collocation.h"
#include "kernels/paff/elasticity.h"
#include "kernels/paff/galerkin.h"

namespace viscera {
namespace {

std::array<const Formulation*, 4> formulations() {
  return {&galerkin_formulation(), &galerkin_quadratic_formulation(), &gfdm_formulation(),
          &paper_formulation()};
}

}  // namespace

const Formulation* find_formulation(std::string_view name) {
  for (const Formulation* formulation : formulations()) {
    if (formulation->name() == name) return formulation;
  }
  return nullptr;
}

std::vector<std::string> formulation_names() {
  std::vector<std::string> names;
  for (const Formulation* formulation : formulations()) names.emplace_back(formulation->name());
  return names;
}

Result<std::vector<double>> solve_static(const Formulation& formulation,
                                         const ElasticProblem& problem, const StaticLoads& loads) {
  auto solver = formulation.prepare(problem, no_progress());
  if (!solver) return std::unexpected(solver.error());
  return (*solver)->solve_static(loads);
}

}  // namespace viscera
