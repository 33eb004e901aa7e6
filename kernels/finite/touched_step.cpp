// A step of a body that anything touches. The conditions of what touches it are solved between the
// quasi-Newton steps: with the energy replaced by its model at u, the cells lie at
// q = Phi (u - H g) without forces and answer these by W = Phi H Phi^T, so that any solver of
// contact finds the forces f, and the step is p = H (Phi^T f - g).
//
// A step begins by going where the last one's loads would have it: the same with those loads in
// place of the gradient, which costs no evaluation and brings the cells where they are wanted. It
// begins from where it was going; from where it stood only where that may be better by more than
// the iterations don't see.
#include <algorithm>
#include <cmath>

#include "kernels/finite/finite_limits.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/finite/secant_pairs.h"
#include "kernels/finite/step_energy.h"

namespace viscera {
namespace {

class Untouched final : public FiniteTouch {
 public:
  /// `like`: whose tissue it is; null: of sound tissue without a memory.
  explicit Untouched(std::size_t nodes, const FiniteTouch* like = nullptr)
      : like_(like), groups_(nodes, -1) {}
  const ChangedTissue& changed() const override {
    return like_ ? like_->changed() : FiniteTouch::changed();
  }
  const Overstress& overstress() const override {
    return like_ ? like_->overstress() : FiniteTouch::overstress();
  }
  std::size_t cells() const override { return 0; }
  std::int32_t held() const override { return 0; }
  std::span<const int> groups() const override { return groups_; }
  void turn(const NodalRotations&) override {}
  const MatrixX& response() const override { return response_; }
  VectorX displaced(const VectorX&) const override { return {}; }
  VectorX answer_to(const VectorX&) const override { return {}; }
  void add_loads(const VectorX&, VectorX&) const override {}
  double begin(const VectorX&) override { return 0.0; }
  bool solve(const VectorX&, const MatrixX&, double, VectorX&) override { return true; }
  std::optional<VectorX> standing() const override { return VectorX(); }

 private:
  const FiniteTouch* like_;
  std::vector<int> groups_;
  MatrixX response_;
};

}  // namespace

class FiniteSolver::TouchedStep {
 public:
  /// From `state`; of a step that goes on, from where that had come.
  TouchedStep(const FiniteSolver& solver, FiniteTouch& touch, const Vec3& acceleration,
              const FiniteState& state, const NodalRotations& rotations, const StepSoFar* so_far)
      : solver_(solver),
        touch_(touch),
        rotations_(rotations),
        energy_(*solver.body_, solver.masses_, solver.options_,
                solver.options_.gravity + acceleration, state, touch.changed(), touch.overstress(),
                so_far ? so_far->strains : nullptr),
        n_(static_cast<Eigen::Index>(state.displacements.size())),
        goes_on_(so_far != nullptr) {
    if (so_far) {
      u_ = so_far->displacements;
      forces_ = so_far->forces;
      return;
    }
    u_ = Eigen::Map<const VectorX>(state.displacements.data(), n_);
    if (const auto standing = touch.standing())
      forces_ = *standing;
    else
      y_ = first_guess(Eigen::Map<const VectorX>(state.loads.data(), n_));
  }

  /// False: the conditions had no answer.
  bool run(int parts, int most, const FiniteState& state, FiniteStep& told) {
    for (int part = 1; part <= parts; ++part) {
      share_ = static_cast<double>(part) / parts;
      Start still;
      if (part == 1 && solver_.options_.dynamic && !goes_on_) {
        still = {u_, forces_, y_};
        u_ += solver_.options_.time_step * Eigen::Map<const VectorX>(state.velocities.data(), n_);
      }
      if (!start_here()) return false;
      told.iterations = 0;
      if (!descend(most, std::move(still), told)) return false;
    }
    told.energy = value_;
    stood_ = forces_;
    return told.converged || take_stock(told);
  }

  const VectorX& u() const { return u_; }
  const VectorX& forces() const { return forces_; }
  VectorX loads() const {
    VectorX load = VectorX::Zero(n_);
    if (touch_.cells() > 0) touch_.add_loads(forces_, load);
    return load;
  }
  /// To go on from.
  StepSoFar so_far() const { return {u_, stood_, rotations_, energy_.strains()}; }
  double value() const { return value_; }
  int evaluations() const { return energy_.evaluations(); }

 private:
  VectorX first_guess(const VectorX& g) const {
    VectorX z = VectorX::Zero(n_);
    if (g.isZero(0.0)) return z;
    const auto count = static_cast<std::size_t>(n_);
    solver_.precondition(rotations_, {g.data(), count}, {z.data(), count});
    return z;
  }

  /// Forces for cells that lie at `free` without them, their loads, and what the factor makes of
  /// these.
  bool answer(const VectorX& free, const MatrixX& more, VectorX& forces, VectorX& load,
              VectorX& y) {
    load = VectorX::Zero(n_);
    y = load;
    forces.resize(0);
    if (touch_.cells() == 0) return true;
    if (!touch_.solve(free, more, share_, forces)) return false;
    touch_.add_loads(forces, load);
    y = touch_.answer_to(forces);
    return true;
  }

  /// Displacements that are at rest with these forces on the cells; where the cells have changed
  /// since, with the loads of which the factor makes y.
  struct Start {
    VectorX u, forces, y;
  };
  /// From u_ to where the forces are at rest that the conditions ask for.
  bool start_here() {
    VectorX forces;
    if (touch_.cells() == 0) {
      if (y_.size() > 0) u_ -= share_of_move(y_) * y_;
    } else if (y_.size() > 0) {
      if (!touch_.solve(touch_.displaced(u_ - y_), {}, share_, forces)) return false;
      move_by(touch_.answer_to(forces) - y_);
    } else {
      if (!touch_.solve(touch_.displaced(u_) - touch_.response() * forces_, {}, share_, forces))
        return false;
      move_by(touch_.answer_to(forces - forces_));
    }
    y_.resize(0);
    forces_ = std::move(forces);
    value_ = energy_.at(u_, &g_);
    return true;
  }

  /// How much of a way no node goes too far on.
  double share_of_move(const VectorX& way) const {
    double farthest = 0.0;
    for (Eigen::Index at = 0; at < n_; at += 3)
      farthest = std::max(farthest, way.segment<3>(at).norm());
    return farthest > kLongestMove ? kLongestMove / farthest : 1.0;
  }
  void move_by(const VectorX& way) { u_ += share_of_move(way) * way; }

  /// Where to, and how the merit E - f . Phi u falls there.
  struct Way {
    VectorX p, forces, load, y;
    double work = 0.0;  // f . Phi p
    double slope = 0.0;
  };

  bool find_way(const VectorX& z, const SecantPairs& pairs, Way& way) {
    const VectorX down = pairs.apply(g_, z);
    MatrixX more;
    if (pairs.size() > 0 && touch_.cells() > 0)
      more = pairs.response_change([&](const VectorX& v) { return touch_.displaced(v); });
    if (!answer(touch_.displaced(u_ - down), more, way.forces, way.load, way.y)) return false;
    way.p = pairs.apply(way.load, way.y) - down;
    way.work = way.load.dot(way.p);
    way.slope = g_.dot(way.p) - way.work;
    return true;
  }

  /// Begins at `other` instead where less energy is.
  bool start_at_less(Start other) {
    const VectorX u = u_, g = g_, forces = forces_;
    const double value = value_;
    u_ = std::move(other.u);
    forces_ = std::move(other.forces);
    y_ = std::move(other.y);
    if (!start_here()) return false;
    if (value_ <= value) return true;
    u_ = u;
    g_ = g;
    forces_ = forces;
    value_ = value;
    return true;
  }

  /// Quasi-Newton steps; from `other`, unless that is empty, if less energy is there. False: the
  /// conditions had no answer.
  bool descend(int most, Start other, FiniteStep& told) {
    SecantPairs pairs;
    VectorX z = first_guess(g_);
    z_.resize(0);
    Way way;
    for (int i = 0; i < most; ++i) {
      if (!find_way(z, pairs, way)) return false;
      if (i == 0 && other.u.size() > 0 && !(-0.5 * way.slope <= kSureStart * std::abs(value_))) {
        if (!start_at_less(std::move(other))) return false;
        z = first_guess(g_);
        if (!find_way(z, pairs, way)) return false;
      }
      if (!(way.slope < 0.0) && pairs.size() > 0) {
        pairs.clear();
        if (!find_way(z, pairs, way)) return false;
      }
      note_residual(-way.slope, told);
      if (told.converged || !(way.slope < 0.0)) {
        keep(way);
        return true;
      }
      ++told.iterations;
      VectorX next, next_g;
      double next_value = value_;
      double length = search(way, next, next_value, next_g);
      if (length < kShortest && pairs.size() > 0) {
        pairs.clear();
        if (!find_way(z, pairs, way)) return false;
        length = search(way, next, next_value, next_g);
      }
      keep(way);
      if (length == 0.0) return true;
      VectorX next_z = first_guess(next_g);
      // What a factor in single precision makes of less is noise, and so is a step by it.
      const bool at_floor = (next_z - z).norm() < kLeastChange * next_z.norm();
      if (!at_floor) pairs.add(next - u_, next_g - g_, next_z - z);
      u_ = std::move(next);
      g_ = std::move(next_g);
      value_ = next_value;
      z = std::move(next_z);
      if (length < 1.0) {
        // A way that was cut short leaves gaps open.
        if (!start_here()) return false;
        z = first_guess(g_);
      }
      if (at_floor) break;
    }
    z_ = std::move(z);
    return true;
  }

  void keep(const Way& way) { forces_ = way.forces; }

  /// How far along the way the merit falls enough; 0: nowhere.
  double search(const Way& way, VectorX& next, double& next_value, VectorX& next_g) {
    const double slack = std::min(kSlack, solver_.options_.decrement);
    double length = share_of_move(way.p);
    for (int trial = 0; trial < kMostTrials; ++trial) {
      next = u_ + length * way.p;
      next_value = energy_.at(next, &next_g);
      const double gained = next_value - value_ - length * way.work;
      if (gained <= kArmijo * length * way.slope + slack * std::abs(value_)) return length;
      const double fit = -0.5 * way.slope * length * length / (gained - length * way.slope);
      length = std::isfinite(fit) ? std::clamp(fit, 0.1 * length, 0.5 * length) : 0.1 * length;
    }
    return 0.0;
  }

  void note_residual(double decrement, FiniteStep& told) const {
    told.residual = residual_of(0.5 * decrement, value_);
    told.converged = told.residual <= solver_.options_.decrement;
  }

  /// Forces, and what a further step would gain, where the last one ended.
  bool take_stock(FiniteStep& told) {
    if (z_.size() == 0) return true;  // it found no way on
    VectorX forces;
    const VectorX at_cells = touch_.displaced(z_);
    double decrement = g_.dot(z_);
    if (touch_.cells() > 0) {
      if (!touch_.solve(touch_.displaced(u_) - at_cells, {}, share_, forces)) return false;
      decrement += forces.dot(touch_.response() * forces) - 2.0 * forces.dot(at_cells);
    }
    note_residual(decrement, told);
    forces_ = std::move(forces);
    return true;
  }

  const FiniteSolver& solver_;
  FiniteTouch& touch_;
  const NodalRotations& rotations_;
  StepEnergy energy_;
  Eigen::Index n_ = 0;
  bool goes_on_ = false;
  VectorX u_, forces_, y_;  // as Start
  double share_ = 1.0;      // of the way that is asked for
  VectorX g_, z_;
  VectorX stood_;  // forces_ as the last way had them
  double value_ = 0.0;
};

FiniteStep FiniteSolver::step(FiniteTouch& touch, FiniteState& state, const Vec3& acceleration,
                              std::optional<StepSoFar>* so_far) const {
  FiniteStep told;
  const std::span<const int> groups = touch.groups();
  int group_count = 0;
  for (const int group : groups) group_count = std::max(group_count, group + 1);
  const StepSoFar* last = so_far && so_far->has_value() ? &**so_far : nullptr;
  const bool warp = state.steps_since_warp >= kStepsAWarp;
  NodalRotations rotations =
      last ? last->rotations : turned_nodes(groups, static_cast<std::size_t>(group_count), state);
  touch.turn(rotations);
  const std::int32_t held = touch.held();
  const std::int32_t released =
      held < state.held ? kStepsReleased : std::max(0, state.steps_released - 1);
  const int most = released > 0 ? options_.iterations_released : options_.iterations;

  TouchedStep step(*this, touch, acceleration, state, rotations, last);
  const double farthest = touch.begin(touch.displaced(step.u()));
  const bool sane = std::isfinite(farthest);
  // What is asked for in metres is a mistake: no number of parts brings it near.
  const double parts = std::clamp(std::ceil(farthest / kLongestWay), 1.0, kFarthest / kLongestWay);
  told.answered = sane && step.run(static_cast<int>(parts), most, state, told);
  told.evaluations = step.evaluations();
  if (so_far) so_far->reset();
  if (!told.answered || !std::isfinite(step.value()) || !is_tissue(step.u())) {
    if (touch.cells() > 0) return step_without(touch, state, acceleration);
    told.lost = true;
    give_up(state);
    return told;
  }
  for (Eigen::Index row = 0; row < step.forces().size(); row += 3)
    told.forces.push_back(step.forces().segment<3>(row));
  finish(step.u(), warp, held, released, state);
  Eigen::Map<VectorX>(state.loads.data(), step.u().size()) = step.loads();
  if (so_far) *so_far = step.so_far();
  state.rotations = std::move(rotations);
  return told;
}

FiniteStep FiniteSolver::step(FiniteState& state, const Vec3& acceleration) const {
  Untouched untouched(body_->nodes());
  return step(untouched, state, acceleration);
}

FiniteStep FiniteSolver::step_without(const FiniteTouch& touch, FiniteState& state,
                                      const Vec3& acceleration) const {
  std::ranges::fill(state.velocities, 0.0);
  std::ranges::fill(state.loads, 0.0);
  state.steps_since_warp = kStepsAWarp;
  Untouched untouched(body_->nodes(), &touch);
  FiniteStep told = step(untouched, state, acceleration);
  told.answered = false;
  return told;
}

}  // namespace viscera
