#include "kernels/finite/finite_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include "kernels/base/parallel.h"
#include "kernels/finite/finite_limits.h"
#include "kernels/finite/secant_pairs.h"
#include "kernels/finite/step_energy.h"

namespace viscera {
namespace {

/// Keeps W from being singular where points are held closer than nodes.
constexpr double kRowsShift = 1e-7;

VectorX to_vector(std::span<const double> x) {
  return Eigen::Map<const VectorX>(x.data(), static_cast<Eigen::Index>(x.size()));
}

std::span<const double> span_of(const VectorX& x) {
  return {x.data(), static_cast<std::size_t>(x.size())};
}

/// The group of each node under grips, where grips that share nodes are one group; -1: none.
std::vector<int> groups_of(std::span<const GripTarget> targets, std::size_t nodes) {
  std::vector<int> parent(targets.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int g) {
    while (parent[static_cast<std::size_t>(g)] != g) g = parent[static_cast<std::size_t>(g)];
    return g;
  };
  std::vector<int> group(nodes, -1);
  for (std::size_t t = 0; t < targets.size(); ++t)
    for (const int node : targets[t].grip->rows.nodes) {
      int& of = group[static_cast<std::size_t>(node)];
      if (of < 0)
        of = static_cast<int>(t);
      else
        parent[static_cast<std::size_t>(std::max(root(of), root(static_cast<int>(t))))] =
            std::min(root(of), root(static_cast<int>(t)));
    }
  for (int& of : group)
    if (of >= 0) of = root(of);
  return group;
}

}  // namespace

void HeldRows::add(std::span<const int> point_nodes, std::span<const double> point_values) {
  nodes.insert(nodes.end(), point_nodes.begin(), point_nodes.end());
  values.insert(values.end(), point_values.begin(), point_values.end());
  begin.push_back(nodes.size());
}

namespace {

Result<void> check_options(const FiniteOptions& options) {
  Error mistakes;
  const auto expect = [&](bool right, const std::string& mistake) {
    if (!right) mistakes.messages.push_back(mistake);
  };
  const double dt = options.time_step;
  expect(std::isfinite(dt) && dt > 0.0,
         "time step: found " + std::to_string(dt) + " s, expected more than 0");
  expect(std::isfinite(options.density) && options.density > 0.0,
         "density: found " + std::to_string(options.density) + " kg/m3, expected more than 0");
  expect(std::isfinite(options.viscous_time) && options.viscous_time >= 0.0,
         "viscous time: found " + std::to_string(options.viscous_time) + " s, expected 0 or more");
  expect(options.iterations > 0 && options.iterations_released > 0,
         "iterations: found " + std::to_string(options.iterations) + " and " +
             std::to_string(options.iterations_released) + " after a release, expected 1 or more");
  expect(options.decrement > 0.0,
         "decrement: found " + std::to_string(options.decrement) + ", expected more than 0");
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

}  // namespace

Result<FiniteSolver> FiniteSolver::prepare(std::shared_ptr<const FiniteBody> body,
                                           std::span<const Vec3> positions,
                                           std::span<const double> volumes,
                                           const FiniteOptions& options) {
  if (auto sound = check_options(options); !sound) return std::unexpected(sound.error());
  const double dt = options.time_step;
  const std::vector<double> rest(3 * body->nodes(), 0.0);
  SymmetricBlockMatrix matrix =
      body->tangent(rest, options.dynamic ? 1.0 + options.viscous_time / dt : 1.0);
  if (options.dynamic)
    for (std::size_t node = 0; node < body->nodes(); ++node)
      for (std::size_t k = 0; k < 3; ++k)
        matrix.blocks[9 * matrix.pattern.row_begin[node] + 4 * k] +=
            options.density * volumes[node] / (dt * dt);
  auto factor = StiffnessFactor::factor(matrix, positions);
  if (!factor) return std::unexpected(factor.error());
  return prepared(std::move(body), volumes, options,
                  std::make_shared<StiffnessFactor>(std::move(*factor)));
}

Result<FiniteSolver> FiniteSolver::prepared(std::shared_ptr<const FiniteBody> body,
                                            std::span<const double> volumes,
                                            const FiniteOptions& options,
                                            std::shared_ptr<const StiffnessFactor> factor) {
  if (auto sound = check_options(options); !sound) return std::unexpected(sound.error());
  if (volumes.size() != body->nodes() || factor->nodes() != body->nodes())
    return failure("factor: found one of " + std::to_string(factor->nodes()) + " nodes with " +
                   std::to_string(volumes.size()) + " volumes, expected " +
                   std::to_string(body->nodes()));
  FiniteSolver solver;
  solver.options_ = options;
  for (const double volume : volumes) solver.masses_.push_back(options.density * volume);
  solver.factor_ = std::move(factor);
  solver.body_ = std::move(body);
  return solver;
}

FiniteSolver FiniteSolver::with(int iterations, double decrement) const {
  FiniteSolver other = *this;
  other.options_.iterations = iterations;
  other.options_.iterations_released = std::max(iterations, options_.iterations_released);
  other.options_.decrement = decrement;
  return other;
}

FiniteState FiniteSolver::at_rest() const {
  const std::size_t n = body_->nodes();
  FiniteState state;
  state.displacements.assign(3 * n, 0.0);
  state.velocities.assign(3 * n, 0.0);
  state.loads.assign(3 * n, 0.0);
  state.rotations = no_rotations(n);
  state.steps_since_warp = kStepsAWarp;
  return state;
}

Grip FiniteSolver::grip(HeldRows rows) const {
  Grip grip;
  const auto n = static_cast<Eigen::Index>(3 * body_->nodes());
  grip.columns.resize(n, static_cast<Eigen::Index>(3 * rows.points()));
  parallel_for_each_index(3 * rows.points(), 1, [&](std::size_t column) {
    VectorX load = VectorX::Zero(n);
    const std::size_t point = column / 3, k = column % 3;
    for (std::size_t e = rows.begin[point]; e < rows.begin[point + 1]; ++e)
      load[static_cast<Eigen::Index>(3 * static_cast<std::size_t>(rows.nodes[e]) + k)] +=
          rows.values[e];
    factor_->apply(span_of(load), {grip.columns.data() + n * static_cast<Eigen::Index>(column),
                                   static_cast<std::size_t>(n)});
  });
  grip.rows = std::move(rows);
  return grip;
}

/// The work of one step.
class FiniteSolver::Descent {
 public:
  Descent(const FiniteSolver& solver, std::span<const GripTarget> targets, const FiniteState& state,
          const NodalRotations& rotations, const std::vector<int>& groups)
      : solver_(solver),
        targets_(targets),
        rotations_(rotations),
        energy_(*solver.body_, solver.masses_, solver.options_, solver.options_.gravity, state) {
    n_ = static_cast<Eigen::Index>(state.displacements.size());
    turn_columns(groups);
    from_ = held(to_vector(state.displacements));
  }

  Eigen::Index rows() const { return rows_; }

  double energy(const VectorX& u, VectorX* gradient) { return energy_.at(u, gradient); }

  /// d - Phi u for targets that have made this share of their way.
  VectorX gaps(const VectorX& u, double share) const {
    VectorX left = -held(u);
    Eigen::Index row = 0;
    for (const GripTarget& target : targets_)
      for (const Vec3& d : target.displacements) {
        left.segment<3>(row) += (1.0 - share) * from_.segment<3>(row) + share * d;
        row += 3;
      }
    return left;
  }

  VectorX held(const VectorX& u) const {
    VectorX at = VectorX::Zero(rows_);
    Eigen::Index row = 0;
    for (const GripTarget& target : targets_) {
      const HeldRows& rows = target.grip->rows;
      for (std::size_t p = 0; p < rows.points(); ++p, row += 3)
        for (std::size_t e = rows.begin[p]; e < rows.begin[p + 1]; ++e)
          at.segment<3>(row) +=
              rows.values[e] * u.segment<3>(3 * static_cast<Eigen::Index>(rows.nodes[e]));
    }
    return at;
  }

  /// Adds the smallest change that takes the held points where they are wanted.
  void make_feasible(VectorX& u, double share) const {
    if (rows_ > 0) u += columns_ * first_.solve(gaps(u, share));
  }

  /// Quasi-Newton steps from u with energy and gradient there, to targets at this share of their
  /// way.
  void descend(VectorX& u, double& value, VectorX& g, double share, int most, FiniteStep& told) {
    share_ = share;
    SecantPairs pairs;
    VectorX z = first_guess(g);
    for (int i = 0; i < most; ++i) {
      Direction way = direction(u, g, z, pairs);
      if (!(way.slope < 0.0) && pairs.size() > 0) {
        pairs.clear();
        way = direction(u, g, z, pairs);
      }
      told.residual = residual_of(-0.5 * way.slope, value);
      told.converged = told.residual <= solver_.options_.decrement;
      if (told.converged || !(way.slope < 0.0)) break;
      ++told.iterations;
      VectorX next, next_g;
      double next_value = value;
      double length = search(u, value, way, next, next_value, next_g);
      if (length < kShortest && pairs.size() > 0) {
        pairs.clear();
        way = direction(u, g, z, pairs);
        length = search(u, value, way, next, next_value, next_g);
      }
      if (length == 0.0) break;
      if (i + 1 < most) {
        VectorX next_z = first_guess(next_g);
        pairs.add(next - u, next_g - g, next_z - z);
        z = std::move(next_z);
      }
      u = std::move(next);
      g = std::move(next_g);
      value = next_value;
    }
  }

  /// On the tissue at the held points, by the work of the residual along what they do to the body.
  std::vector<Vec3> forces(const VectorX& g) const {
    std::vector<Vec3> all;
    if (rows_ == 0) return all;
    const VectorX lambda = first_.solve(columns_.transpose() * g);
    for (Eigen::Index row = 0; row < rows_; row += 3) all.push_back(lambda.segment<3>(row));
    return all;
  }

  int evaluations() const { return energy_.evaluations(); }

 private:
  VectorX first_guess(const VectorX& g) const {
    VectorX z(n_);
    apply_warped(*solver_.factor_, rotations_, span_of(g),
                 {z.data(), static_cast<std::size_t>(n_)});
    return z;
  }

  /// Y = R P^-1 Phi^T R_group^T, and W = Phi Y of the factor alone.
  void turn_columns(const std::vector<int>& groups) {
    for (const GripTarget& target : targets_)
      rows_ += 3 * static_cast<Eigen::Index>(target.grip->rows.points());
    columns_.resize(n_, rows_);
    Eigen::Index row = 0;
    for (const GripTarget& target : targets_) {
      const HeldRows& rows = target.grip->rows;
      const auto width = static_cast<Eigen::Index>(3 * rows.points());
      const Mat3 own = rotation_of(rotations_, static_cast<std::size_t>(rows.nodes.front()));
      for (Eigen::Index p = 0; p < width; p += 3)
        for (std::size_t node = 0; node < groups.size(); ++node) {
          const auto at = static_cast<Eigen::Index>(3 * node);
          columns_.block<3, 3>(at, row + p) = rotation_of(rotations_, node) *
                                              target.grip->columns.block<3, 3>(at, p) *
                                              own.transpose();
        }
      row += width;
    }
    if (rows_ == 0) return;
    MatrixX own_rows(rows_, rows_);
    for (Eigen::Index column = 0; column < rows_; ++column)
      own_rows.col(column) = held(columns_.col(column));
    first_ = factor_rows(std::move(own_rows));
  }

  /// Where to, and how the merit E - lambda . Phi u falls there.
  struct Direction {
    VectorX p, lambda, held;  // held: Phi p
    double slope = 0.0;
  };

  /// p = H (Phi^T lambda - g), with lambda such that the held points come to where they are wanted.
  Direction direction(const VectorX& u, const VectorX& g, const VectorX& z,
                      const SecantPairs& pairs) const {
    Direction way;
    way.p = -pairs.apply(g, z);
    if (rows_ > 0) {
      const VectorX wanted = gaps(u, share_) - held(way.p);
      if (pairs.size() == 0) {
        way.lambda = first_.solve(wanted);
        way.p += columns_ * way.lambda;
      } else {
        MatrixX columns(n_, rows_), rows(rows_, rows_);
        for (Eigen::Index c = 0; c < rows_; ++c) {
          columns.col(c) = pairs.apply(row_load(c), columns_.col(c));
          rows.col(c) = held(columns.col(c));
        }
        way.lambda = factor_rows(std::move(rows)).solve(wanted);
        way.p += columns * way.lambda;
      }
      way.held = held(way.p);
    }
    way.slope = g.dot(way.p) - (rows_ > 0 ? way.lambda.dot(way.held) : 0.0);
    return way;
  }

  /// W, kept from being singular where points are held closer than nodes.
  static Eigen::LDLT<MatrixX> factor_rows(MatrixX rows) {
    rows = (0.5 * (rows + rows.transpose())).eval();
    rows.diagonal().array() += kRowsShift * rows.trace() / static_cast<double>(rows.rows());
    return rows.ldlt();
  }

  /// The nodal loads of a unit force at a held point.
  VectorX row_load(Eigen::Index column) const {
    VectorX load = VectorX::Zero(n_);
    Eigen::Index row = 0;
    for (const GripTarget& target : targets_) {
      const HeldRows& rows = target.grip->rows;
      for (std::size_t p = 0; p < rows.points(); ++p, row += 3) {
        if (column < row || column >= row + 3) continue;
        for (std::size_t e = rows.begin[p]; e < rows.begin[p + 1]; ++e)
          load[3 * static_cast<Eigen::Index>(rows.nodes[e]) + column - row] += rows.values[e];
      }
    }
    return load;
  }

  /// How far along the way the merit falls enough; 0: nowhere.
  double search(const VectorX& u, double value, const Direction& way, VectorX& next,
                double& next_value, VectorX& next_g) {
    const double work = rows_ > 0 ? way.lambda.dot(way.held) : 0.0;
    const double slack = std::min(kSlack, solver_.options_.decrement);
    double length = 1.0;
    for (int trial = 0; trial < kMostTrials; ++trial) {
      next = u + length * way.p;
      next_value = energy(next, &next_g);
      const double gained = next_value - value - length * work;
      if (gained <= kArmijo * length * way.slope + slack * std::abs(value)) return length;
      const double fit = -0.5 * way.slope * length * length / (gained - way.slope * length);
      length = std::isfinite(fit) ? std::clamp(fit, 0.1 * length, 0.5 * length) : 0.1 * length;
    }
    return 0.0;
  }

  const FiniteSolver& solver_;
  std::span<const GripTarget> targets_;
  const NodalRotations& rotations_;
  Eigen::Index n_ = 0, rows_ = 0;
  StepEnergy energy_;
  MatrixX columns_;
  VectorX from_;        // Phi u at the step's start
  double share_ = 1.0;  // of the way that targets have made
  Eigen::LDLT<MatrixX> first_;
};

bool FiniteSolver::turn_nodes(std::span<const int> groups, std::size_t group_count,
                              const FiniteState& state, NodalRotations& rotations) const {
  rotations = state.rotations;
  const std::size_t nodes = body_->nodes();
  if (state.steps_since_warp >= kStepsAWarp) {
    const std::vector<Mat3> means = body_->mean_gradients(state.displacements);
    std::vector<Mat3> of_group(group_count, Mat3::Zero());
    for (std::size_t node = 0; node < nodes; ++node)
      if (groups[node] >= 0) of_group[static_cast<std::size_t>(groups[node])] += means[node];
    for (Mat3& f : of_group) f = polar_rotation(f);
    for (std::size_t node = 0; node < nodes; ++node)
      Eigen::Map<Mat3>(rotations.data() + 9 * node) =
          groups[node] >= 0 ? of_group[static_cast<std::size_t>(groups[node])]
                            : polar_rotation(means[node]);
    return true;
  }
  // What is newly held turns as its first node does until rotations are taken anew.
  std::vector<int> first(group_count, -1);
  for (std::size_t node = 0; node < nodes; ++node) {
    if (groups[node] < 0) continue;
    int& of = first[static_cast<std::size_t>(groups[node])];
    if (of < 0) of = static_cast<int>(node);
    const Mat3 shared = rotation_of(rotations, static_cast<std::size_t>(of));
    Eigen::Map<Mat3>(rotations.data() + 9 * node) = shared;
  }
  return false;
}

void FiniteSolver::finish(const VectorX& u, bool warped, std::int32_t held, std::int32_t released,
                          FiniteState& state) const {
  if (options_.dynamic) {
    for (Eigen::Index at = 0; at < u.size(); at += 3) {
      Vec3 velocity =
          (u.segment<3>(at) - Vec3::Map(state.displacements.data() + at)) / options_.time_step;
      if (const double speed = velocity.norm(); speed > kFastest) velocity *= kFastest / speed;
      Vec3::Map(state.velocities.data() + at) = velocity;
    }
  }
  std::copy(u.begin(), u.end(), state.displacements.begin());
  state.steps_since_warp = warped ? 1 : state.steps_since_warp + 1;
  state.steps_released = released;
  state.held = held;
}

FiniteStep FiniteSolver::step(std::span<const GripTarget> targets, FiniteState& state) const {
  FiniteStep told;
  const std::size_t nodes = body_->nodes();
  const std::vector<int> groups = groups_of(targets, nodes);
  NodalRotations rotations;
  const bool warp = turn_nodes(groups, targets.size(), state, rotations);

  std::int32_t held = 0;
  for (const GripTarget& target : targets)
    held += static_cast<std::int32_t>(target.grip->rows.points());
  const std::int32_t released =
      held < state.held ? kStepsReleased : std::max(0, state.steps_released - 1);
  const int most = released > 0 ? options_.iterations_released : options_.iterations;

  Descent descent(*this, targets, state, rotations, groups);
  const VectorX before = to_vector(state.displacements);
  double farthest = 0.0;
  if (descent.rows() > 0) {
    const VectorX way = descent.gaps(before, 1.0);
    for (Eigen::Index row = 0; row < way.size(); row += 3)
      farthest = std::max(farthest, way.segment<3>(row).norm());
  }
  const bool sane = std::isfinite(farthest);
  const int parts = sane ? std::max(1, static_cast<int>(std::ceil(farthest / kLongestWay))) : 1;

  VectorX u = before, g;
  double value = 0.0;
  for (int part = 1; part <= parts && sane; ++part) {
    const double way = static_cast<double>(part) / parts;
    VectorX still = u;
    descent.make_feasible(still, way);
    value = descent.energy(still, &g);
    if (part == 1 && options_.dynamic) {
      VectorX moving = before + options_.time_step * to_vector(state.velocities);
      descent.make_feasible(moving, way);
      VectorX moving_g;
      const double of_moving = descent.energy(moving, &moving_g);
      if (of_moving < value) {
        still.swap(moving);
        g.swap(moving_g);
        value = of_moving;
      }
    }
    u = std::move(still);
    told.iterations = 0;
    descent.descend(u, value, g, way, most, told);
  }
  told.evaluations = descent.evaluations();
  told.energy = value;

  if (!sane || !std::isfinite(value) || !is_tissue(u)) {
    told.lost = true;
    give_up(state);
    return told;
  }
  told.forces = descent.forces(g);
  finish(u, warp, held, released, state);
  state.rotations = std::move(rotations);
  return told;
}

}  // namespace viscera
