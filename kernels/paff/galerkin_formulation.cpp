// The `galerkin` formulation behind the common interface: prepare, solve, compliance.
#include <algorithm>

#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"
#include "kernels/paff/galerkin.h"

namespace viscera {
namespace {

/// Ascending, each once, within [0, count).
bool is_node_list(const std::vector<int>& nodes, std::size_t count) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i] < 0 || static_cast<std::size_t>(nodes[i]) >= count) return false;
    if (i > 0 && nodes[i] <= nodes[i - 1]) return false;
  }
  return true;
}

/// Round-off differs above and below the diagonal; contact wants the square exactly symmetric.
void symmetrise_touchable_square(SurfaceCompliance& compliance) {
  const std::size_t rows = compliance.rows();
  std::vector<std::size_t> row_of;
  for (const int node : compliance.touchable) {
    const auto found = std::lower_bound(compliance.visible.begin(), compliance.visible.end(), node);
    const auto place = static_cast<std::size_t>(found - compliance.visible.begin());
    for (std::size_t k = 0; k < 3; ++k) row_of.push_back(3 * place + k);
  }
  for (std::size_t i = 0; i < row_of.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      float& below = compliance.columns[j * rows + row_of[i]];
      float& above = compliance.columns[i * rows + row_of[j]];
      below = above = 0.5f * (below + above);
    }
  }
}

class GalerkinSolver final : public ElasticSolver {
 public:
  GalerkinSolver(GalerkinSystem system, SparseCholesky factor, const PreparationFigures& figures)
      : system_(std::move(system)), factor_(std::move(factor)), figures_(figures) {}

  Result<void> solve(std::span<double> loads, int columns) override {
    return factor_.solve(loads, columns);
  }

  Result<std::vector<double>> solve_static(const StaticLoads& loads) override {
    std::vector<double> unknowns = system_.loads(loads);
    if (const Result<void> solved = factor_.solve(unknowns, 1); !solved) {
      return std::unexpected(solved.error());
    }
    return unknowns;
  }

  Result<SurfaceCompliance> compliance(std::vector<int> visible, std::vector<int> touchable,
                                       const Progress& progress) override {
    const Stopwatch watch;
    const std::size_t nodes = figures_.unknowns / 3;
    if (!is_node_list(visible, nodes) || !is_node_list(touchable, nodes) ||
        !std::includes(visible.begin(), visible.end(), touchable.begin(), touchable.end())) {
      return failure(
          "compliance: expected visible and touchable nodes ascending, each once, below " +
          std::to_string(nodes) + ", touchable ones among the visible");
    }
    SurfaceCompliance compliance{std::move(visible), std::move(touchable), {}};
    const std::size_t rows = compliance.rows();
    const std::size_t column_count = 3 * compliance.touchable.size();
    compliance.columns.resize(rows * column_count);

    std::vector<int> units;
    std::vector<double> block;
    for (std::size_t first = 0; first < column_count; first += kColumnsAtOnce) {
      if (!progress(static_cast<double>(first) / static_cast<double>(column_count),
                    "computing compliance")) {
        return failure(kCancelled);
      }
      const std::size_t last = std::min(column_count, first + kColumnsAtOnce);
      units.clear();
      for (std::size_t c = first; c < last; ++c) {
        units.push_back(3 * compliance.touchable[c / 3] + static_cast<int>(c % 3));
      }
      block.resize(figures_.unknowns * units.size());
      if (const Result<void> solved = factor_.solve_units(units, block); !solved) {
        return std::unexpected(solved.error());
      }
      parallel_for_each_index(last - first, 8, [&](std::size_t c) {
        const double* solution = block.data() + c * figures_.unknowns;
        float* column = compliance.columns.data() + (first + c) * rows;
        for (std::size_t v = 0; v < compliance.visible.size(); ++v) {
          const double* triple = solution + 3 * compliance.visible[v];
          for (std::size_t k = 0; k < 3; ++k) column[3 * v + k] = static_cast<float>(triple[k]);
        }
      });
    }
    symmetrise_touchable_square(compliance);
    figures_.compliance_s += watch.seconds();
    if (!progress(1.0, "computing compliance")) return failure(kCancelled);
    return compliance;
  }

  const PreparationFigures& figures() const override { return figures_; }

 private:
  /// Wide enough for matrix products to run at full speed, small enough to stop soon when asked.
  static constexpr std::size_t kColumnsAtOnce = 256;

  GalerkinSystem system_;
  SparseCholesky factor_;
  PreparationFigures figures_;
};

class GalerkinFormulation final : public Formulation {
 public:
  GalerkinFormulation(std::string_view name, Basis basis, double support_factor)
      : name_(name), basis_(basis), support_factor_(support_factor) {}

  std::string_view name() const override { return name_; }
  int version() const override { return 2; }
  double support_factor() const override { return support_factor_; }
  Basis basis() const override { return basis_; }

  Result<std::unique_ptr<ElasticSolver>> prepare(const ElasticProblem& problem,
                                                 const Progress& progress) const override {
    constexpr double kAssemblyShare = 0.25;
    Result<GalerkinSystem> system = GalerkinSystem::assemble(
        problem, basis_, support_factor_, [&](double fraction, std::string_view what) {
          return progress(kAssemblyShare * fraction, what);
        });
    if (!system) return std::unexpected(system.error());
    if (!progress(kAssemblyShare, "factoring")) return failure(kCancelled);
    const Stopwatch watch;
    Result<SparseCholesky> factor = system->factor();
    if (!factor) return std::unexpected(factor.error());
    PreparationFigures figures = system->figures();
    figures.factor_s = watch.seconds();
    figures.factor_bytes = factor->factor_bytes();
    if (!progress(1.0, "factoring")) return failure(kCancelled);
    return std::make_unique<GalerkinSolver>(std::move(*system), std::move(*factor), figures);
  }

 private:
  std::string_view name_;
  Basis basis_;
  double support_factor_;
};

}  // namespace

const Formulation& galerkin_formulation() {
  static const GalerkinFormulation formulation("galerkin", Basis::linear, 1.8);
  return formulation;
}

const Formulation& galerkin_quadratic_formulation() {
  static const GalerkinFormulation formulation("galerkin_quadratic", Basis::quadratic, 2.4);
  return formulation;
}

}  // namespace viscera
