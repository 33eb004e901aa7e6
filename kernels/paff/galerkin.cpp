#include "kernels/paff/galerkin.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"
#include "kernels/paff/consistent_gradients.h"
#include "kernels/paff/problem_checks.h"
#include "kernels/paff/true_neighbours.h"
#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

/// Nitsche's penalty over modulus / h [Nitsche1971]: well above what keeps the stiffness positive
/// definite for these fields, and small enough to leave its conditioning alone.
constexpr double kNitscheFactor = 100.0;

/// Local spacing at a point where the fields are known, sum phi_J h_J [m].
double spacing_at(const PointCloud& cloud, std::span<const int> nodes,
                  std::span<const double> values) {
  double h = 0.0;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    h += values[j] * cloud.spacings[static_cast<std::size_t>(nodes[j])];
  }
  return h;
}

/// Nitsche's penalty [Pa/m], beta = rate (2 mu I + lambda n n^T), rate = 100/h: the held traction
/// that it must outweigh is 2 mu strain n + lambda div(u) n, and only its second part, along the
/// normal, grows without bound towards incompressibility.
Mat3 nitsche_penalty(const IsotropicMaterial& material, double rate, const Vec3& normal) {
  return rate * (2.0 * material.shear_modulus() * Mat3::Identity() +
                 material.lame_lambda() * normal * normal.transpose());
}

Result<FixedPoints> fixed_points(const ShapeFunctions& shape, const SurfaceQuadrature& surface) {
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
  for (std::size_t b = 0; b < fixed.points.size(); ++b) {
    const std::size_t begin = fixed.fields.begin[b], count = fixed.fields.begin[b + 1] - begin;
    fixed.rate.push_back(kNitscheFactor /
                         spacing_at(shape.cloud(),
                                    std::span(fixed.fields.nodes).subspan(begin, count),
                                    std::span(fixed.fields.values).subspan(begin, count)));
  }
  return fixed;
}

/// The part of lambda that a body of this Poisson's ratio would have stays pointwise: these fields
/// don't lock under it, and it resists what averages don't see, as under narrow loads. Below it
/// averages would only cost: twice the entries of the stiffness.
constexpr double kPointwisePoissonRatio = 0.3;
/// From this one on all the rest is averaged. Between the two the averaged share grows, so that a
/// body's answer has no jump over Poisson's ratio, nor has its slope: the rest is zero at the lower
/// one, and the share stops growing at the upper one.
constexpr double kAllAveragedFrom = 0.4;

/// Lame's lambda of what is integrated point by point, and of what acts on averaged dilatation.
struct SplitLambda {
  double pointwise, averaged;
};

SplitLambda split_lambda(const IsotropicMaterial& material) {
  const double lambda = material.lame_lambda();
  if (!averages_dilatation(material)) return {lambda, 0.0};
  const double pointwise = 2.0 * material.shear_modulus() * kPointwisePoissonRatio /
                           (1.0 - 2.0 * kPointwisePoissonRatio);
  if (material.poisson_ratio >= kAllAveragedFrom) return {pointwise, lambda - pointwise};
  const double s = (material.poisson_ratio - kPointwisePoissonRatio) /
                   (kAllAveragedFrom - kPointwisePoissonRatio);
  const double averaged = s * (2.0 - s) * (lambda - pointwise);
  return {lambda - averaged, averaged};
}

/// K_IJ of an isotropic body is L(X_IJ) + B_IJ + Y_IJ with L(X) = lambda X + mu X^T + mu tr(X) I
/// and
///   X_IJ = sum_q w g~_I g~_J^T - sum_b w (phi_I n g_J^T + g_I n^T phi_J),
///   B_IJ = sum_b w phi_I beta phi_J,
/// q over the volume, b over the fixed surface: the material enters once a block, not once a point.
/// Where the dilatation is averaged, L has the pointwise part of lambda and
///   Y_IJ = (averaged part) sum_r (G_I G_J^T - T_I G_J^T - G_I T_J^T)
/// over the rows r of the MeanDilatation: Nitsche's held traction takes the averaged dilatation
/// too, since the energy bounds no other.
/// Without points of the volume (`fields` empty), what the hold adds alone: X of b, B, and of Y the
/// terms with T.
SymmetricBlockMatrix assemble_stiffness(std::size_t node_count, const IsotropicMaterial& material,
                                        const VolumeQuadrature& volume, const PointFields& fields,
                                        const NodeIncidence& incidence,
                                        const SurfaceQuadrature& surface, const FixedPoints& fixed,
                                        const MeanDilatation& dilatation) {
  const bool hold_alone = fields.points() == 0;
  using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const auto [lambda, averaged] = split_lambda(material);
  const double mu = material.shear_modulus();
  const NodeIncidence fixed_incidence(fixed.fields, node_count);
  const NodeIncidence dilatation_incidence(dilatation.rows, node_count);
  SymmetricBlockMatrix stiffness;
  stiffness.width = 3;
  stiffness.pattern = symmetric_pattern(node_count, {{fields, incidence},
                                                     {fixed.fields, fixed_incidence},
                                                     {dilatation.rows, dilatation_incidence}});
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
    std::vector<Block> added(row_size, Block::Zero());  // B + Y
    for (const NodeIncidence::Entry& at : fixed_incidence.of(row)) {
      const std::size_t b = static_cast<std::size_t>(at.point);
      const double weight = surface.weights[fixed.points[b]];
      const Vec3& normal = surface.normals[fixed.points[b]];
      const Vec3 own_value = weight * fixed.fields.values[at.entry] * normal;
      const Vec3 own_gradient = weight * fixed.fields.gradients[at.entry];
      const Block own_penalty =
          weight * fixed.fields.values[at.entry] * nitsche_penalty(material, fixed.rate[b], normal);
      for (std::size_t e = at.entry; e < fixed.fields.begin[b + 1]; ++e) {
        const std::size_t to = slot[static_cast<std::size_t>(fixed.fields.nodes[e])];
        block(to).noalias() -= own_value * fixed.fields.gradients[e].transpose();
        block(to).noalias() -= own_gradient * (fixed.fields.values[e] * normal).transpose();
        added[to - row_begin] += own_penalty * fixed.fields.values[e];
      }
    }
    for (const NodeIncidence::Entry& at : dilatation_incidence.of(row)) {
      const Vec3 own_gradient = averaged * dilatation.rows.gradients[at.entry];
      const Vec3 own_flux = averaged * dilatation.fluxes[at.entry];
      const Vec3 own_net = hold_alone ? Vec3(-own_flux) : Vec3(own_gradient - own_flux);
      const std::size_t end = dilatation.rows.begin[static_cast<std::size_t>(at.point) + 1];
      for (std::size_t e = at.entry; e < end; ++e) {
        Block& to = added[slot[static_cast<std::size_t>(dilatation.rows.nodes[e])] - row_begin];
        to.noalias() += own_net * dilatation.rows.gradients[e].transpose();
        to.noalias() -= own_gradient * dilatation.fluxes[e].transpose();
      }
    }
    for (std::size_t e = row_begin; e < row_begin + row_size; ++e) {
      const Block x = block(e);
      block(e) = lambda * x + mu * x.transpose() + added[e - row_begin];
      block(e).diagonal().array() += mu * x.trace();
    }
    // A diagonal block is symmetric but for the order of its sums.
    const Block diagonal = block(row_begin);
    block(row_begin) = 0.5 * (diagonal + diagonal.transpose());
  });
  return stiffness;
}

/// Adds that of fibres. With a their direction and E their modulus it is
///   K_IJ = (sum_q w E (a.g~_I)(a.g~_J) + sum_b w E (beta (a.n)^2 phi_I phi_J
///           - (a.n) (phi_I (a.g_J) + (a.g_I) phi_J))) a a^T,
/// q over the volume, b over the fixed surface, beta = 100/h: Nitsche's terms, as above. Without
/// points of the volume, those alone.
void add_fibres(const VolumeQuadrature& volume, const PointFields& fields,
                std::span<const Fibres> fibres, const SurfaceQuadrature& surface,
                const FixedPoints& fixed, std::span<const Fibres> held,
                SymmetricBlockMatrix& stiffness) {
  using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const std::size_t nodes = stiffness.pattern.rows();
  const NodeIncidence incidence(fields, nodes), fixed_incidence(fixed.fields, nodes);
  for_each_row(stiffness.pattern, [&](std::size_t row, std::span<const std::size_t> slot) {
    const auto block = [&](int node) {
      return Eigen::Map<Block>(stiffness.blocks.data() + 9 * slot[static_cast<std::size_t>(node)]);
    };
    for (const NodeIncidence::Entry& at : incidence.of(row)) {
      const auto q = static_cast<std::size_t>(at.point);
      const auto& [a, modulus] = fibres[q];
      if (modulus == 0.0) continue;
      const double own = volume.weights[q] * modulus * a.dot(fields.gradients[at.entry]);
      for (std::size_t e = at.entry; e < fields.begin[q + 1]; ++e)
        block(fields.nodes[e]) += own * a.dot(fields.gradients[e]) * a * a.transpose();
    }
    for (const NodeIncidence::Entry& at : fixed_incidence.of(row)) {
      const auto b = static_cast<std::size_t>(at.point);
      const auto& [a, modulus] = held[fixed.points[b]];
      if (modulus == 0.0) continue;
      const double through = a.dot(surface.normals[fixed.points[b]]);
      const double stiff = surface.weights[fixed.points[b]] * modulus * through;
      const double value = stiff * fixed.fields.values[at.entry],
                   gradient = stiff * a.dot(fixed.fields.gradients[at.entry]),
                   penalty = fixed.rate[b] * through;
      for (std::size_t e = at.entry; e < fixed.fields.begin[b + 1]; ++e)
        block(fixed.fields.nodes[e]) +=
            (value * (penalty * fixed.fields.values[e] - a.dot(fixed.fields.gradients[e])) -
             gradient * fixed.fields.values[e]) *
            a * a.transpose();
    }
  });
}

/// Under nodes of loose pieces; on the diagonal alone, as a step of a body with mass has that.
void add_foundation(double stiff, std::span<const int> under, const VolumeQuadrature& volume,
                    const PointFields& fields, SymmetricBlockMatrix& stiffness) {
  for (std::size_t q = 0; q < volume.size(); ++q)
    for (std::size_t e = fields.begin[q]; e < fields.begin[q + 1]; ++e) {
      const auto node = static_cast<std::size_t>(fields.nodes[e]);
      if (under[node] < 0) continue;
      const std::size_t row = stiffness.pattern.row_begin[node];
      for (std::size_t k = 0; k < 3; ++k)
        stiffness.blocks[9 * row + 4 * k] += stiff * volume.weights[q] * fields.values[e];
    }
}

/// What is asked for at the points, over the cubes that they stand for.
template <class Value>
std::vector<Value> at_points(const VolumeQuadrature& volume,
                             const std::function<Value(const Vec3&, double)>& asked) {
  std::vector<Value> values(volume.size());
  parallel_for_each_index(volume.size(), 64, [&](std::size_t q) {
    values[q] = asked(volume.positions[q], std::cbrt(volume.weights[q]));
  });
  return values;
}

/// Of each held point of the surface that of the nearest one of the volume: Nitsche's penalty must
/// outweigh the traction of tissue whose energy bounds it.
template <class Value>
std::vector<Value> at_held(const SurfaceQuadrature& surface, const FixedPoints& fixed,
                           const VolumeQuadrature& volume, const std::vector<Value>& values,
                           const Value& elsewhere) {
  const KdTree tree(volume.positions);
  std::vector<Value> held(surface.size(), elsewhere);
  std::vector<KdTree::Found> found;
  for (const std::size_t b : fixed.points) {
    tree.nearest(surface.positions[b], 1, -1, found);
    held[b] = values[static_cast<std::size_t>(found.front().index)];
  }
  return held;
}

/// Nodes and gradients at some of the points.
PointFields of_points(const PointFields& all, std::span<const std::size_t> numbers) {
  PointFields some;
  for (const std::size_t q : numbers) {
    const auto first = static_cast<std::ptrdiff_t>(all.begin[q]),
               last = static_cast<std::ptrdiff_t>(all.begin[q + 1]);
    some.nodes.insert(some.nodes.end(), all.nodes.begin() + first, all.nodes.begin() + last);
    some.gradients.insert(some.gradients.end(), all.gradients.begin() + first,
                          all.gradients.begin() + last);
    some.begin.push_back(some.nodes.size());
  }
  return some;
}

/// Those rows of averaged dilatation through which a hold acts.
MeanDilatation held_rows(const MeanDilatation& all) {
  MeanDilatation held;
  for (std::size_t row = 0; row < all.rows.points(); ++row) {
    const auto first = static_cast<std::ptrdiff_t>(all.rows.begin[row]),
               last = static_cast<std::ptrdiff_t>(all.rows.begin[row + 1]);
    if (std::all_of(all.fluxes.begin() + first, all.fluxes.begin() + last,
                    [](const Vec3& flux) { return flux.isZero(0.0); }))
      continue;
    held.rows.nodes.insert(held.rows.nodes.end(), all.rows.nodes.begin() + first,
                           all.rows.nodes.begin() + last);
    held.rows.gradients.insert(held.rows.gradients.end(), all.rows.gradients.begin() + first,
                               all.rows.gradients.begin() + last);
    held.fluxes.insert(held.fluxes.end(), all.fluxes.begin() + first, all.fluxes.begin() + last);
    held.rows.begin.push_back(held.rows.nodes.size());
  }
  return held;
}

template <class Points>
Points weighed(Points points, std::span<const double> modulus) {
  for (std::size_t i = 0; i < modulus.size(); ++i) points.weights[i] *= modulus[i];
  return points;
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

bool averages_dilatation(const IsotropicMaterial& material) {
  return material.poisson_ratio > kPointwisePoissonRatio;
}

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
  system.fields_ = problem.fields ? problem.fields
                                  : std::make_shared<ShapeFunctions>(
                                        *problem.surface, *problem.cloud, support_factor, basis);
  const ShapeFunctions& shape = *system.fields_;
  const std::size_t n = shape.cloud().size();
  const TissuePaths* paths = shape.true_neighbours() ? &shape.true_neighbours()->paths() : nullptr;
  const LocalSpacing spacing(*problem.cloud);
  const bool quadratic = basis == Basis::kQuadratic;  // degrees: see consistent_gradients.h
  system.surface_ =
      surface_quadrature(*problem.surface, spacing, problem.is_fixed, quadratic ? 4 : 2);
  system.figures_.fixed_area = fixed_area(system.surface_);
  if (!(system.figures_.fixed_area > 0.0 || problem.foundation > 0.0)) {
    return failure(
        "fixed region: it holds no part of the surface; expected a region that meets the surface");
  }
  Result<VolumeQuadrature> volume =
      background_quadrature(*problem.surface, spacing, quadratic ? 2 : 1, paths,
                            problem.few_points ? SmallCells::kOne : SmallCells::kEight);
  if (!volume) return std::unexpected(volume.error());
  system.volume_ = std::move(*volume);

  if (!progress(0.1, "evaluating shape functions")) return failure(kCancelled);
  Result<PointFields> inside = evaluate_fields(shape, system.volume_.positions, true);
  if (!inside) return std::unexpected(inside.error());
  Result<PointFields> on_surface = evaluate_fields(shape, system.surface_.positions, false);
  if (!on_surface) return std::unexpected(on_surface.error());
  Result<FixedPoints> fixed = fixed_points(shape, system.surface_);
  if (!fixed) return std::unexpected(fixed.error());
  system.pieces_ = tissue_pieces(n, *inside, fixed->fields);
  if (!problem.may_have_free_pieces && problem.foundation == 0.0) {
    if (std::string free = free_pieces_text(system.pieces_, shape.cloud(), problem.cloud->size());
        !free.empty())
      return failure(free);
  }

  if (!progress(0.3, "making gradients consistent")) return failure(kCancelled);
  const NodeIncidence incidence(*inside, n);
  Result<ConsistencyChange> correction = make_gradients_consistent(
      shape, system.volume_, incidence, system.surface_, *on_surface, *inside);
  if (!correction) return std::unexpected(correction.error());
  system.multipliers_ = std::move(correction->multipliers);

  if (!progress(0.7, "assembling")) return failure(kCancelled);
  if (problem.relative_modulus) {
    system.modulus_ = at_points(system.volume_, problem.relative_modulus);
    if (std::string mistake = modulus_mistake(system.volume_, system.modulus_); !mistake.empty())
      return failure(mistake);
    system.held_modulus_ = at_held(system.surface_, *fixed, system.volume_, system.modulus_, 1.0);
  }
  if (problem.fibres) {
    system.fibres_ = at_points(system.volume_, problem.fibres);
    if (std::string mistake = fibres_mistake(system.volume_, system.fibres_, problem.material);
        !mistake.empty())
      return failure(mistake);
    system.held_fibres_ =
        at_held(system.surface_, *fixed, system.volume_, system.fibres_, Fibres());
  }
  const VolumeQuadrature volume_points = system.weighed_volume();
  const SurfaceQuadrature surface_points = system.weighed_surface();
  if (averages_dilatation(problem.material)) {
    system.dilatation_ =
        mean_dilatation(spacing, n, volume_points, *inside,
                        {surface_points, fixed->points, fixed->fields, fixed->rate}, paths);
  }
  if (!problem.points_alone) {
    system.stiffness_ = assemble_stiffness(n, problem.material, volume_points, *inside, incidence,
                                           surface_points, *fixed, system.dilatation_);
    if (!system.fibres_.empty())
      add_fibres(system.volume_, *inside, system.fibres_, system.surface_, *fixed,
                 system.held_fibres_, system.stiffness_);
    if (problem.foundation > 0.0)
      add_foundation(problem.foundation, loose_pieces(system.pieces_, n), system.volume_, *inside,
                     system.stiffness_);
  }
  system.fixed_ = std::move(*fixed);
  if (problem.few_points) {
    inside->values = std::vector<double>();  // {} would keep their memory
    inside->weights = std::vector<double>();
    system.inside_ = std::move(*inside);
  }
  system.figures_.unknowns = 3 * n;
  if (!problem.points_alone) system.figures_.stiffness_nonzeros = system.stiffness_.nonzeros();
  system.figures_.quadrature_points = system.volume_.size();
  system.figures_.twins = n - problem.cloud->size();
  system.figures_.gradient_correction = correction->size;
  system.figures_.assemble_s = watch.seconds();
  if (!progress(1.0, "assembling")) return failure(kCancelled);
  return system;
}

VolumeQuadrature GalerkinSystem::weighed_volume() const {
  return weighed(volume_, modulus_);
}

SurfaceQuadrature GalerkinSystem::weighed_surface() const {
  return weighed(surface_, held_modulus_);
}

std::vector<double> GalerkinSystem::loads(const StaticLoads& loads) const {
  std::vector<double> all(figures_.unknowns, 0.0);
  ShapeValues at;
  const auto spread = [&](const Vec3& x, const Vec3& force) {
    fields_->evaluate(x, false, at);
    for (std::size_t j = 0; j < at.nodes.size(); ++j) add(all, at.nodes[j], at.values[j] * force);
  };
  if (loads.body_force) {
    for (std::size_t q = 0; q < volume_.size(); ++q) {
      spread(volume_.positions[q], volume_.weights[q] * loads.body_force(volume_.positions[q]));
    }
  }
  if (loads.traction) {
    for (std::size_t b = 0; b < surface_.size(); ++b) {
      if (surface_.fixed[b]) continue;
      const Vec3& x = surface_.positions[b];
      spread(x, surface_.weights[b] * loads.traction(x, surface_.normals[b]));
    }
  }
  if (loads.held_displacement) add_held(loads, all);
  return all;
}

void GalerkinSystem::add_held(const StaticLoads& loads, std::vector<double>& all) const {
  const auto [lambda, averaged] = split_lambda(material_);
  const double mu = material_.shear_modulus();
  const std::size_t terms = dilatation_.terms;
  std::vector<double> held_flux(dilatation_.rows.points(), 0.0);  // sum_b w psi u.n  (rows)
  std::size_t fixed = 0;                                          // counts the fixed points
  ShapeValues at;
  for (std::size_t b = 0; b < surface_.size(); ++b) {
    if (!surface_.fixed[b]) continue;
    const Vec3& n = surface_.normals[b];
    fields_->evaluate(surface_.positions[b], true, at);
    const double h = spacing_at(fields_->cloud(), at.nodes, at.values);
    const double weight = surface_.weights[b] * (held_modulus_.empty() ? 1.0 : held_modulus_[b]);
    const Vec3 held = weight * loads.held_displacement(surface_.positions[b]);
    const Vec3 penalty = nitsche_penalty(material_, kNitscheFactor / h, n) * held;
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      // Traction of phi_J e_k through n, times the held displacement, for k = x, y, z.
      const Vec3& g = at.gradients[j];
      const Vec3 conjugate = lambda * n.dot(held) * g + mu * g.dot(held) * n + mu * g.dot(n) * held;
      add(all, at.nodes[j], at.values[j] * penalty - conjugate);
    }
    if (!held_fibres_.empty()) {
      const auto& [a, modulus] = held_fibres_[b];
      const double through = a.dot(n),
                   strength = surface_.weights[b] * modulus * through *
                              a.dot(loads.held_displacement(surface_.positions[b]));
      for (std::size_t j = 0; j < at.nodes.size(); ++j)
        add(all, at.nodes[j],
            strength * (kNitscheFactor / h * through * at.values[j] - a.dot(at.gradients[j])) * a);
    }
    for (std::size_t k = 0; k < terms; ++k) {
      held_flux[dilatation_.first_row[fixed] + k] +=
          dilatation_.psi[fixed * terms + k] * n.dot(held);
    }
    ++fixed;
  }
  for (std::size_t row = 0; row < held_flux.size(); ++row) {
    if (held_flux[row] == 0.0) continue;
    for (std::size_t e = dilatation_.rows.begin[row]; e < dilatation_.rows.begin[row + 1]; ++e) {
      add(all, dilatation_.rows.nodes[e],
          -averaged * held_flux[row] * dilatation_.rows.gradients[e]);
    }
  }
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

Result<SymmetricBlockMatrix> GalerkinSystem::hold() const {
  const std::size_t n = fields_->cloud().size();
  const PointFields none;
  SymmetricBlockMatrix hold = assemble_stiffness(n, material_, {}, none, NodeIncidence(none, n),
                                                 weighed_surface(), fixed_, held_rows(dilatation_));
  if (!held_fibres_.empty()) add_fibres({}, none, {}, surface_, fixed_, held_fibres_, hold);
  return hold;
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

Result<ElasticRegion> GalerkinSystem::region(const std::function<bool(const Vec3&)>& wanted) const {
  ElasticRegion region;
  region.shear_modulus = material_.shear_modulus();
  const SplitLambda lambda = split_lambda(material_);
  region.pointwise_lambda = lambda.pointwise;
  region.averaged_lambda = lambda.averaged;
  VolumeQuadrature points;
  std::vector<std::size_t> numbers;
  for (std::size_t q = 0; q < volume_.size(); ++q) {
    if (!wanted(volume_.positions[q])) continue;
    points.positions.push_back(volume_.positions[q]);
    points.weights.push_back(volume_.weights[q]);
    numbers.push_back(q);
  }
  if (numbers.empty()) return region;
  Result<PointFields> fields = inside_.points() > 0
                                   ? of_points(inside_, numbers)
                                   : evaluate_fields(*fields_, points.positions, true);
  if (!fields) return std::unexpected(fields.error());
  if (inside_.points() == 0) correct_gradients(*fields_, points, multipliers_, *fields);
  region.positions = std::move(points.positions);
  region.weights = std::move(points.weights);
  if (!modulus_.empty()) {
    for (const std::size_t q : numbers) region.modulus.push_back(modulus_[q]);
    for (std::size_t i = 0; i < region.size(); ++i) region.weights[i] *= region.modulus[i];
  }
  if (!fibres_.empty())
    for (const std::size_t q : numbers) region.fibres.push_back(fibres_[q]);
  region.begin = std::move(fields->begin);
  region.point_nodes = std::move(fields->nodes);
  region.gradients = std::move(fields->gradients);
  if (lambda.averaged > 0.0) add_cells(numbers, region);
  number_nodes(fields_->cloud().size(), region);
  return region;
}

/// The cells of these points of the volume, with all their rows.
void GalerkinSystem::add_cells(std::span<const std::size_t> numbers, ElasticRegion& region) const {
  const std::size_t terms = dilatation_.terms;
  std::vector<int> cells;
  for (const std::size_t q : numbers) cells.push_back(dilatation_.cell[q]);
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  for (const std::size_t q : numbers) {
    const auto at = std::lower_bound(cells.begin(), cells.end(), dilatation_.cell[q]);
    region.cell.push_back(static_cast<int>(at - cells.begin()));
    const auto psi = std::span(dilatation_.volume_psi).subspan(terms * q, terms);
    region.psi.insert(region.psi.end(), psi.begin(), psi.end());
  }
  for (const int cell : cells) {
    const PointFields& rows = dilatation_.rows;
    const std::size_t row = terms * static_cast<std::size_t>(cell);
    const auto at = [](const auto& values, std::size_t i) {
      return values.begin() + static_cast<std::ptrdiff_t>(i);
    };
    region.cell_nodes.insert(region.cell_nodes.end(), at(rows.nodes, rows.begin[row]),
                             at(rows.nodes, rows.begin[row + 1]));
    region.cell_gradients.insert(region.cell_gradients.end(), at(rows.gradients, rows.begin[row]),
                                 at(rows.gradients, rows.begin[row + terms]));
    region.cell_begin.push_back(region.cell_nodes.size());
  }
}

Result<SparseCholesky> GalerkinSystem::factor() const {
  return SparseCholesky::factor(stiffness_, 0.0, "stiffness");
}

}  // namespace viscera
