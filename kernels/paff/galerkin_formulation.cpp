// The `galerkin` formulation behind the common interface: prepare, solve, compliance.
#include "kernels/base/stopwatch.h"
#include "kernels/paff/compliance_checks.h"
#include "kernels/paff/galerkin.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {
namespace {

class GalerkinSolver final : public ElasticSolver, public RegionSolver {
 public:
  /// `factor` null: it knows its points alone.
  GalerkinSolver(GalerkinSystem system, std::shared_ptr<const StiffnessFactor> factor,
                 const PreparationFigures& figures)
      : system_(std::move(system)), factor_(std::move(factor)), figures_(figures) {}

  Result<void> solve(std::span<double> loads, int columns) override {
    if (!factor_) return no_factor();
    return factor_->solve(system_.stiffness(), loads, columns);
  }

  Result<std::vector<double>> solve_static(const StaticLoads& loads) override {
    if (!factor_) return std::unexpected(no_factor().error());
    std::vector<double> unknowns = system_.loads(loads);
    if (const Result<void> solved = factor_->solve(system_.stiffness(), unknowns, 1); !solved) {
      return std::unexpected(solved.error());
    }
    return unknowns;
  }

  Result<SurfaceCompliance> compliance(const SparseWeights& places, std::vector<int> touchable,
                                       const Progress& progress) override {
    if (!factor_) return std::unexpected(no_factor().error());
    const Stopwatch watch;
    auto compliance = factor_->compliance(places, std::move(touchable), progress);
    if (compliance) {
      figures_.smallest_compliance_eigenvalue = smallest_compliance_eigenvalue(*compliance);
      const auto positive = expect_positive_compliance(figures_.smallest_compliance_eigenvalue);
      if (!positive) compliance = std::unexpected(positive.error());
    }
    figures_.compliance_s += watch.seconds();
    return compliance;
  }

  std::shared_ptr<const StiffnessFactor> factor() const override { return factor_; }

  const PreparationFigures& figures() const override { return figures_; }

  Result<ElasticRegion> region(const std::function<bool(const Vec3&)>& wanted) const override {
    return system_.region(wanted);
  }

  Result<SymmetricBlockMatrix> hold() const override { return system_.hold(); }

  const std::vector<TissuePiece>& pieces() const override { return system_.pieces(); }

  std::vector<double> held_loads(
      const std::function<Vec3(const Vec3&)>& displacement) const override {
    return system_.loads({.body_force = {}, .traction = {}, .held_displacement = displacement});
  }

 private:
  static Result<void> no_factor() {
    return failure("stiffness: it was prepared for its points alone, expected one with a factor");
  }

  GalerkinSystem system_;
  std::shared_ptr<const StiffnessFactor> factor_;
  PreparationFigures figures_;
};

class GalerkinFormulation final : public Formulation {
 public:
  GalerkinFormulation(std::string_view name, Basis basis, double support_factor)
      : name_(name), basis_(basis), support_factor_(support_factor) {}

  std::string_view name() const override { return name_; }
  /// What a build without MUMPS has stored, with other last digits, is of another version.
  int version() const override { return SparseCholesky::is_by_mumps() ? 7 : 107; }
  double support_factor() const override { return support_factor_; }
  Basis basis() const override { return basis_; }
  bool keeps_factor() const override { return true; }
  bool stays_in_tissue() const override { return true; }
  Coupling coupling(const IsotropicMaterial& material) const override {
    return {.support_factor = support_factor_, .averaged = averages_dilatation(material)};
  }

  Result<std::unique_ptr<ElasticSolver>> prepare(const ElasticProblem& problem,
                                                 const Progress& progress) const override {
    constexpr double kAssemblyShare = 0.25;
    Result<GalerkinSystem> system = GalerkinSystem::assemble(
        problem, basis_, support_factor_, [&](double fraction, std::string_view what) {
          return progress(kAssemblyShare * fraction, what);
        });
    if (!system) return std::unexpected(system.error());
    if (problem.points_alone) {
      const PreparationFigures figures = system->figures();
      return std::make_unique<GalerkinSolver>(std::move(*system), nullptr, figures);
    }
    if (!progress(kAssemblyShare, "factoring")) return failure(kCancelled);
    const Stopwatch watch;
    Result<StiffnessFactor> factor =
        StiffnessFactor::factor(system->stiffness(), system->fields().cloud().positions,
                                FactorPrecision::kMeasured, problem.most_memory);
    if (!factor) return std::unexpected(factor.error());
    PreparationFigures figures = system->figures();
    figures.factor_s = watch.seconds();
    figures.factor_bytes = factor->factor_bytes();
    if (!progress(1.0, "factoring")) return failure(kCancelled);
    return std::make_unique<GalerkinSolver>(
        std::move(*system), std::make_shared<const StiffnessFactor>(std::move(*factor)), figures);
  }

 private:
  std::string_view name_;
  Basis basis_;
  double support_factor_;
};

}  // namespace

const Formulation& galerkin_formulation() {
  static const GalerkinFormulation formulation("galerkin", Basis::kLinear, 1.8);
  return formulation;
}

const Formulation& galerkin_quadratic_formulation() {
  static const GalerkinFormulation formulation("galerkin_quadratic", Basis::kQuadratic, 2.4);
  return formulation;
}

}  // namespace viscera
