#include "kernels/paff/galerkin.h"

#include <cmath>
#include <limits>

#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"
#include "kernels/paff/consistent_gradients.h"
#include "kernels/paff/problem_checks.h"

namespace viscera {
namespace {

/// Nitsche's penalty over (lambda + 2 mu) / h [Nitsche1971]: well above what keeps the stiffness
/// positive definite for these fields, and small enough to leave its conditioning alone.
constexpr double kNitscheFactor = 100.0;

/// The fixed points of the surface with the shape functions there and Nitsche's beta.
struct FixedPoints {
  std::vector<std::size_t> points;  ///< index into the SurfaceQuadrature
  PointFields fields;
  std::vector<double> penalty;  ///< beta = 100 (lambda + 2 mu) / h, h = sum phi_J h_J [Pa/m]
};

Result<FixedPoints> fixed_points(const ShapeFunctions& shape, const SurfaceQuadrature& surface,
                                 const IsotropicMaterial& material) {
  FixedPoints fixed;
  std::vector<Vec3> positions;
  for (std::size_t b = 0; b < surface.size(); ++b) {
    if (!surface.fixed[b]) continue;
    fixed.points.push_back(b);
    positions.push_back(surface.positions[b]);
  }
  Result<PointFields> fields = evaluate_fields(shape, positions, true);
  if (!fields) return std::unexpected(fields.error());
  fixed.fields = std::move(*fields);
  const double modulus = material.lame_lambda() + 2.0 * material.shear_modulus();
  for (std::size_t b = 0; b < fixed.points.size(); ++b) {
    double h = 0.0;
    for (std::size_t e = fixed.fields.begin[b]; e < fixed.fields.begin[b + 1]; ++e) {
      const std::size_t node = static_cast<std::size_t>(fixed.fields.nodes[e]);
      h += fixed.fields.values[e] * shape.cloud().spacings[node];
    }
    fixed.penalty.push_back(kNitscheFactor * modulus / h);
  }
  return fixed;
}

/// K_IJ of an isotropic body is L(X_IJ) + B_IJ I with L(X) = lambda X + mu X^T + mu tr(X) I, where
///   X_IJ = sum_q w g~_I g~_J^T - sum_b w (phi_I n g_J^T + g_I n^T phi_J),  B_IJ = sum_b w beta
///   phi_I phi_J,
/// q over the volume, b over the fixed surface: the material enters once a block, not once a point.
SymmetricBlockMatrix assemble_stiffness(std::size_t node_count, const IsotropicMaterial& material,
                                        const VolumeQuadrature& volume, const PointFields& fields,
                                        const NodeIncidence& incidence,
                                        const SurfaceQuadrature& surface,
                                        const FixedPoints& fixed) {
  using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const double lambda = material.lame_lambda(), mu = material.shear_modulus();
  const NodeIncidence fixed_incidence(fixed.fields, node_count);
  SymmetricBlockMatrix stiffness;
  stiffness.width = 3;
  stiffness.pattern =
      symmetric_pattern(node_count, {{fields, incidence}, {fixed.fields, fixed_incidence}});
  stiffness.blocks.assign(9 * stiffness.pattern.columns.size(), 0.0);

  for_each_row(stiffness.pattern, [&](std::size_t row, std::span<const std::size_t> slot) {
    const std::size_t row_begin = stiffness.pattern.row_begin[row];
    const std::size_t row_size = stiffness.pattern.row_begin[row + 1] - row_begin;
    const auto block = [&](std::size_t e) {
      return Eigen::Map<Block>(stiffness.blocks.data() + 9 * e);
    };
    for (const NodeIncidence::Entry& at : incidence.of(row)) {
      const std::size_t q = static_cast<std::size_t>(at.point);
      const Vec3 own = volume.weights[q] * fields.gradients[at.entry];
      for (std::size_t e = at.entry; e < fields.begin[q + 1]; ++e) {
        block(slot[static_cast<std::size_t>(fields.nodes[e])]).noalias() +=
            own * fields.gradients[e].transpose();
      }
    }
    std::vector<double> penalty(row_size, 0.0);
    for (const NodeIncidence::Entry& at : fixed_incidence.of(row)) {
      const std::size_t b = static_cast<std::size_t>(at.point);
      const double weight = surface.weights[fixed.points[b]];
      const Vec3& normal = surface.normals[fixed.points[b]];
      const Vec3 own_value = weight * fixed.fields.values[at.entry] * normal;
      const Vec3 own_gradient = weight * fixed.fields.gradients[at.entry];
      const double own_penalty = weight * fixed.penalty[b] * fixed.fields.values[at.entry];
      for (std::size_t e = at.entry; e < fixed.fields.begin[b + 1]; ++e) {
        const std::size_t to = slot[static_cast<std::size_t>(fixed.fields.nodes[e])];
        block(to).noalias() -= own_value * fixed.fields.gradients[e].transpose();
        block(to).noalias() -= own_gradient * (fixed.fields.values[e] * normal).transpose();
        penalty[to - row_begin] += own_penalty * fixed.fields.values[e];
      }
    }
    for (std::size_t e = row_begin; e < row_begin + row_size; ++e) {
      const Block x = block(e);
      block(e) = lambda * x + mu * x.transpose();
      block(e).diagonal().array() += mu * x.trace() + penalty[e - row_begin];
    }
    // A diagonal block is symmetric but for the order of its sums.
    const Block diagonal = block(row_begin);
    block(row_begin) = 0.5 * (diagonal + diagonal.transpose());
  });
  return stiffness;
}

double fixed_area(const SurfaceQuadrature& surface) {
  double area = 0.0;
  for (std::size_t b = 0; b < surface.size(); ++b) {
    if (surface.fixed[b]) area += surface.weights[b];
  }
  return area;
}

void add(std::vector<double>& loads, int node, const Vec3& force) {
  for (int k = 0; k < 3; ++k)
    loads[3 * static_cast<std::size_t>(node) + static_cast<std::size_t>(k)] += force[k];
}

}  // namespace

Result<GalerkinSystem> GalerkinSystem::assemble(const ElasticProblem& problem, Basis basis,
                                                double support_factor, const Progress& progress) {
  const Stopwatch watch;
  if (std::vector<std::string> mistakes = problem_mistakes(problem); !mistakes.empty()) {
    Error error;
    error.messages = std::move(mistakes);
    return std::unexpected(error);
  }
  if (!progress(0.0, "laying quadrature points")) return failure(kCancelled);
  GalerkinSystem system;
  system.material_ = problem.material;
  const std::size_t n = problem.cloud->size();
  const LocalSpacing spacing(*problem.cloud);
  const bool quadratic = basis == Basis::quadratic;  // degrees: see consistent_gradients.h
  system.surface_ =
      surface_quadrature(*problem.surface, spacing, problem.is_fixed, quadratic ? 4 : 2);
  system.figures_.fixed_area = fixed_area(system.surface_);
  if (!(system.figures_.fixed_area > 0.0)) {
    return failure(
        "fixed region: it holds no part of the surface; expected a region that meets the surface");
  }
  Result<VolumeQuadrature> volume =
      background_quadrature(*problem.surface, spacing, quadratic ? 2 : 1);
  if (!volume) return std::unexpected(volume.error());
  system.volume_ = std::move(*volume);

  if (!progress(0.1, "evaluating shape functions")) return failure(kCancelled);
  system.fields_ = std::make_shared<ShapeFunctions>(*problem.cloud, support_factor, basis);
  const ShapeFunctions& shape = *system.fields_;
  Result<PointFields> inside = evaluate_fields(shape, system.volume_.positions, true);
  if (!inside) return std::unexpected(inside.error());
  Result<PointFields> on_surface = evaluate_fields(shape, system.surface_.positions, false);
  if (!on_surface) return std::unexpected(on_surface.error());
  Result<FixedPoints> fixed = fixed_points(shape, system.surface_, problem.material);
  if (!fixed) return std::unexpected(fixed.error());

  if (!progress(0.3, "making gradients consistent")) return failure(kCancelled);
  const NodeIncidence incidence(*inside, n);
  const Result<double> correction = make_gradients_consistent(
      shape, system.volume_, incidence, system.surface_, *on_surface, *inside);
  if (!correction) return std::unexpected(correction.error());

  if (!progress(0.7, "assembling")) return failure(kCancelled);
  system.stiffness_ = assemble_stiffness(n, problem.material, system.volume_, *inside, incidence,
                                         system.surface_, *fixed);
  system.figures_.unknowns = 3 * n;
  system.figures_.stiffness_nonzeros = system.stiffness_.nonzeros();
  system.figures_.quadrature_points = system.volume_.size();
  system.figures_.gradient_correction = *correction;
  system.figures_.assemble_s = watch.seconds();
  if (!progress(1.0, "assembling")) return failure(kCancelled);
  return system;
}

std::vector<double> GalerkinSystem::loads(const StaticLoads& loads) const {
  std::vector<double> all(figures_.unknowns, 0.0);
  const double lambda = material_.lame_lambda(), mu = material_.shear_modulus();
  ShapeValues at;
  if (loads.body_force) {
    for (std::size_t q = 0; q < volume_.size(); ++q) {
      fields_->evaluate(volume_.positions[q], false, at);
      const Vec3 force = volume_.weights[q] * loads.body_force(volume_.positions[q]);
      for (std::size_t j = 0; j < at.nodes.size(); ++j) add(all, at.nodes[j], at.values[j] * force);
    }
  }
  for (std::size_t b = 0; b < surface_.size(); ++b) {
    const Vec3& x = surface_.positions[b];
    const Vec3& n = surface_.normals[b];
    if (!surface_.fixed[b]) {
      if (!loads.traction) continue;
      fields_->evaluate(x, false, at);
      const Vec3 force = surface_.weights[b] * loads.traction(x, n);
      for (std::size_t j = 0; j < at.nodes.size(); ++j) add(all, at.nodes[j], at.values[j] * force);
      continue;
    }
    if (!loads.held_displacement) continue;
    fields_->evaluate(x, true, at);
    double h = 0.0;
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      h += at.values[j] * fields_->cloud().spacings[static_cast<std::size_t>(at.nodes[j])];
    }
    const double penalty = kNitscheFactor * (lambda + 2.0 * mu) / h;
    const Vec3 held = surface_.weights[b] * loads.held_displacement(x);
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      // Traction of phi_J e_k through n, times the held displacement, for k = x, y, z.
      const Vec3& g = at.gradients[j];
      const Vec3 conjugate = lambda * n.dot(held) * g + mu * g.dot(held) * n + mu * g.dot(n) * held;
      add(all, at.nodes[j], penalty * at.values[j] * held - conjugate);
    }
  }
  return all;
}

Result<std::vector<double>> GalerkinSystem::solve(const StaticLoads& static_loads) const {
  Result<SparseCholesky> factored = factor();
  if (!factored) return std::unexpected(factored.error());
  std::vector<double> unknowns = loads(static_loads);
  if (const Result<void> solved = factored->solve(unknowns, 1); !solved) {
    return std::unexpected(solved.error());
  }
  return unknowns;
}

Vec3 GalerkinSystem::displacement(std::span<const double> unknowns, const Vec3& x) const {
  ShapeValues at;
  if (!fields_->evaluate(x, false, at)) {
    return Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  Vec3 sum = Vec3::Zero();
  for (std::size_t j = 0; j < at.nodes.size(); ++j) {
    sum += at.values[j] * Vec3::Map(unknowns.data() + 3 * at.nodes[j]);
  }
  return sum;
}

Result<SparseCholesky> GalerkinSystem::factor() const {
  return SparseCholesky::factor(stiffness_, 0.0, "stiffness");
}

}  // namespace viscera
