#include "kernels/finite/finite_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "kernels/base/parallel.h"
#include "kernels/finite/finite_limits.h"
#include "kernels/finite/touched_step.h"
#include "kernels/finite/untouched.h"

namespace viscera {
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
  for (const RelaxationTerm& term : options.relaxation)
    expect(std::isfinite(term.share) && term.share > 0.0 && std::isfinite(term.time) &&
               term.time > 0.0,
           "relaxation: found " + std::to_string(term.share) + " of the modulus within " +
               std::to_string(term.time) + " s, expected both above 0");
  expect(options.iterations > 0 && options.iterations_released > 0,
         "iterations: found " + std::to_string(options.iterations) + " and " +
             std::to_string(options.iterations_released) + " after a release, expected 1 or more");
  expect(options.dynamic || !options.free,
         "free: found a body that nothing holds without motion of its own, expected dynamic");
  expect(options.decrement > 0.0,
         "decrement: found " + std::to_string(options.decrement) + ", expected more than 0");
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

}  // namespace

Result<FiniteSolver> FiniteSolver::prepare(std::shared_ptr<const FiniteBody> body,
                                           std::span<const Vec3> positions,
                                           std::span<const double> volumes,
                                           const FiniteOptions& options,
                                           std::span<const int> piece_of) {
  if (auto sound = check_options(options); !sound) return std::unexpected(sound.error());
  const double dt = options.time_step;
  const std::vector<double> rest(3 * body->nodes(), 0.0);
  // A step meets tissue as stiff as what has had no time to relax.
  const double stiff = 1.0 + overstiffness(stepped(options.relaxation, dt));
  TangentChange change{.pointwise = true};
  if (options.dynamic) change.shear += options.viscous_time / (stiff * dt);
  SymmetricBlockMatrix matrix = body->tangent(rest, change);
  for (double& number : matrix.blocks) number *= stiff;
  if (options.dynamic)
    for (std::size_t node = 0; node < body->nodes(); ++node)
      for (std::size_t k = 0; k < 3; ++k)
        matrix.blocks[9 * matrix.pattern.row_begin[node] + 4 * k] +=
            inertia_over_step(options) * volumes[node];
  auto factor = StiffnessFactor::factor(matrix, positions);
  if (!factor) return std::unexpected(factor.error());
  return prepared(std::move(body), positions, volumes, options,
                  std::make_shared<StiffnessFactor>(std::move(*factor)), piece_of);
}

Result<FiniteSolver> FiniteSolver::prepared(std::shared_ptr<const FiniteBody> body,
                                            std::span<const Vec3> positions,
                                            std::span<const double> volumes,
                                            const FiniteOptions& options,
                                            std::shared_ptr<const StiffnessFactor> factor,
                                            std::span<const int> piece_of) {
  if (auto sound = check_options(options); !sound) return std::unexpected(sound.error());
  if (volumes.size() != body->nodes() || factor->nodes() != body->nodes())
    return failure("factor: found one of " + std::to_string(factor->nodes()) + " nodes with " +
                   std::to_string(volumes.size()) + " volumes, expected " +
                   std::to_string(body->nodes()));
  if (!options.dynamic && std::ranges::any_of(piece_of, [](int piece) { return piece >= 0; }))
    return failure(
        "a piece that nothing holds: found one without motion of its own, expected "
        "dynamic");
  FiniteSolver solver;
  solver.options_ = options;
  solver.terms_ = stepped(options.relaxation, options.time_step);
  solver.take_nodes(positions, volumes, piece_of);
  if (options.dynamic) solver.compact_ = std::make_shared<CompactFactor>(factor->pack());
  solver.factor_ = std::move(factor);
  solver.body_ = std::move(body);
  return solver;
}

Result<FiniteSolver> FiniteSolver::prepare_in_levels(
    std::shared_ptr<const FiniteBody> body, const ElasticRegion& region,
    const SymmetricBlockMatrix& hold, const PointCloud& cloud, std::span<const double> volumes,
    const FiniteOptions& options, std::shared_ptr<const StiffnessFactor> coarse) {
  if (auto sound = check_options(options); !sound) return std::unexpected(sound.error());
  const double dt = options.time_step;
  // As `prepare` makes it.
  RestTerms terms;
  terms.stiff = 1.0 + overstiffness(stepped(options.relaxation, dt));
  std::vector<double> inertia;
  if (options.dynamic) {
    terms.shear = 1.0 + options.viscous_time / (terms.stiff * dt);
    for (const double volume : volumes) inertia.push_back(inertia_over_step(options) * volume);
    terms.inertia = inertia;
  }
  auto levels = TwoLevels::make(RestStiffness::assemble(body->nodes(), region, hold, terms),
                                cloud.positions, cloud.spacings, std::move(coarse));
  if (!levels) return std::unexpected(levels.error());
  FiniteSolver solver;
  solver.options_ = options;
  solver.terms_ = stepped(options.relaxation, dt);
  solver.take_nodes(cloud.positions, volumes, {});
  solver.levels_ = std::make_shared<const TwoLevels>(std::move(*levels));
  solver.body_ = std::move(body);
  return solver;
}

void FiniteSolver::take_nodes(std::span<const Vec3> positions, std::span<const double> volumes,
                              std::span<const int> piece_of) {
  for (const double volume : volumes) masses_.push_back(options_.density * volume);
  loose_ = options_.free ? LoosePieces::of_free_body(positions, masses_)
                         : LoosePieces(piece_of, positions, masses_);
}

FiniteSolver FiniteSolver::with(std::shared_ptr<const FiniteBody> body) const {
  FiniteSolver other = *this;
  other.body_ = std::move(body);
  return other;
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
  grip.groups.assign(body_->nodes(), -1);
  for (const int node : rows.nodes) grip.groups[static_cast<std::size_t>(node)] = 0;
  const auto n = static_cast<Eigen::Index>(3 * body_->nodes());
  grip.columns.resize(n, static_cast<Eigen::Index>(3 * rows.points()));
  parallel_for_each_index(3 * rows.points(), 1, [&](std::size_t column) {
    VectorX load = VectorX::Zero(n);
    const std::size_t point = column / 3, k = column % 3;
    for (std::size_t e = rows.begin[point]; e < rows.begin[point + 1]; ++e)
      load[static_cast<Eigen::Index>(3 * static_cast<std::size_t>(rows.nodes[e]) + k)] +=
          rows.values[e];
    const std::span<const double> from(load.data(), static_cast<std::size_t>(n));
    const std::span<double> to(grip.columns.data() + n * static_cast<Eigen::Index>(column),
                               static_cast<std::size_t>(n));
    if (levels_)
      levels_->apply(from, to);
    else
      factor_->apply(from, to);
  });
  grip.rows = std::move(rows);
  return grip;
}

void FiniteSolver::precondition(const NodalRotations& rotations, std::span<const double> g,
                                std::span<double> out) const {
  if (levels_)
    apply_warped(*levels_, rotations, g, out);
  else if (compact_)
    apply_warped(*compact_, rotations, g, out);
  else
    apply_warped(*factor_, rotations, g, out);
}

VectorX FiniteSolver::coming(const FiniteState& state) const {
  const auto n = static_cast<Eigen::Index>(state.displacements.size());
  const VectorX u = Eigen::Map<const VectorX>(state.displacements.data(), n);
  const VectorX way = options_.time_step * Eigen::Map<const VectorX>(state.velocities.data(), n);
  return loose_.empty() ? VectorX(u + way) : loose_.gone_by(u, way, true);
}

BodyLoad FiniteSolver::load_in_view(BodyLoad load, const FiniteState& state) const {
  if (loose_.empty()) return load;
  const auto n = static_cast<Eigen::Index>(state.displacements.size());
  const std::vector<int> stopped =
      loose_.out_of_view(Eigen::Map<const VectorX>(state.displacements.data(), n));
  if (!stopped.empty() && load.forces.size() == 0) load.forces = VectorX::Zero(n);
  const std::span<const double> weight = body_->weight();
  for (const int node : stopped) {
    const auto at = static_cast<std::size_t>(node);
    Vec3 force = masses_[at] * (options_.gravity + load.acceleration);
    if (!weight.empty()) force += Vec3::Map(weight.data() + 3 * at);
    load.forces.segment<3>(static_cast<Eigen::Index>(3 * at)) -= force;
  }
  return load;
}

NodalRotations FiniteSolver::turned_nodes(std::span<const int> groups,
                                          const FiniteState& state) const {
  NodalRotations rotations = state.rotations;
  if (!loose_.whole()) turn_held_nodes(groups, state, rotations);
  if (!loose_.empty()) loose_.set(loose_.rotations(*body_, coming(state)), rotations);
  return rotations;
}

void FiniteSolver::turn_held_nodes(std::span<const int> groups, const FiniteState& state,
                                   NodalRotations& rotations) const {
  int last_group = -1;
  for (const int group : groups) last_group = std::max(last_group, group);
  const auto group_count = static_cast<std::size_t>(last_group + 1);
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
    return;
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
    for (const int node : loose_.out_of_view(u))
      Vec3::Map(state.velocities.data() + 3 * node).setZero();
  }
  std::copy(u.begin(), u.end(), state.displacements.begin());
  state.steps_since_warp = warped ? 1 : state.steps_since_warp + 1;
  state.steps_released = released;
  state.held = held;
}

FiniteStep FiniteSolver::step(FiniteTouch& touch, FiniteState& state, const BodyLoad& load,
                              std::optional<StepSoFar>* so_far) const {
  TouchedStep step(*this, touch, state, load, so_far);
  while (const TouchQuestion* question = step.question()) step.answer(touch.solve(*question));
  return step.end();
}

FiniteStep FiniteSolver::step(FiniteState& state, const BodyLoad& load) const {
  Untouched untouched(body_->nodes());
  return step(untouched, state, load);
}

}  // namespace viscera
