#include "kernels/paff/elasticity.h"

namespace viscera {

Result<std::vector<double>> solve_static(const Formulation& formulation,
                                         const ElasticProblem& problem, const StaticLoads& loads) {
  auto solver = formulation.prepare(problem, no_progress());
  if (!solver) return std::unexpected(solver.error());
  return (*solver)->solve_static(loads);
}

}  // namespace viscera
