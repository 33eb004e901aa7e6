// A step of a body that anything touches. The conditions of what touches it are solved between the
// quasi-Newton steps: with the energy replaced by its model at u, the cells lie at
// q = Phi (u - H g) without forces and answer these by W = Phi H Phi^T, so that any solver of
// contact finds the forces f, and the step is p = H (Phi^T f - g).
//
// A step begins by going where the last one's loads would have it: the same with those loads in
// place of the gradient, which costs no evaluation and brings the cells where they are wanted. It
// begins from where it was going; from where it stood only where that may be better by more than
// the iterations don't see.
#include "kernels/finite/touched_step.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "kernels/base/task.h"
#include "kernels/finite/finite_limits.h"
#include "kernels/finite/secant_pairs.h"
#include "kernels/finite/step_energy.h"
#include "kernels/finite/untouched.h"

namespace viscera {
namespace {

/// A loose piece that has turned on by this takes its factor with it [rad]. Its square times E is
/// what a factor that lags takes a turn to cost; what mass withstands one with, rho h^2 / dt^2, is
/// more for nodes 5 mm apart up to 95 MPa.
constexpr double kLeastTurn = 1e-3;

/// What a step gains that moves all of the body by no more than kNoWay [J].
double noise_of(const FiniteOptions& options, std::span<const double> masses) {
  if (!options.dynamic) return 0.0;
  const double speed = kNoWay / options.time_step;
  return 0.5 * std::accumulate(masses.begin(), masses.end(), 0.0) * speed * speed;
}

}  // namespace

class TouchedStep::Descent {
 public:
  /// From `state`; of a step that goes on, from where that had come.
  Descent(const FiniteSolver& solver, FiniteTouch& touch, FiniteState& state, const BodyLoad& load,
          std::optional<StepSoFar>* so_far, bool shared)
      : solver_(solver),
        loose_(solver.loose()),
        touch_(touch),
        state_(state),
        given_(load),
        load_(solver.load_in_view(load, state)),
        so_far_(so_far),
        shared_(shared),
        goes_on_(so_far && so_far->has_value()),
        warp_(state.steps_since_warp >= kStepsAWarp),
        rotations_(goes_on_ ? (*so_far)->rotations : solver.turned_nodes(touch.groups(), state)),
        energy_(*solver.body_, solver.masses_, solver.options_, load_, state, touch.changed(),
                touch.overstress(), goes_on_ ? (*so_far)->strains : nullptr),
        n_(static_cast<Eigen::Index>(state.displacements.size())),
        noise_(noise_of(solver.options_, solver.masses_)),
        task_(run()) {
    touch_.turn(rotations_);
    held_ = touch_.held();
    released_ = held_ < state_.held ? kStepsReleased : std::max(0, state_.steps_released - 1);
    if (goes_on_) {
      u_ = (*so_far)->displacements;
      forces_ = (*so_far)->forces;
    } else {
      u_ = Eigen::Map<const VectorX>(state_.displacements.data(), n_);
      if (const auto standing = touch_.standing())
        forces_ = *standing;
      else
        y_ = first_guess(Eigen::Map<const VectorX>(state_.loads.data(), n_));
    }
    task_.begin();
  }

  const TouchQuestion* question() const { return questions_.open(); }
  void answer(std::optional<VectorX> forces) { questions_.answer(std::move(forces)); }

  FiniteStep end(const VectorX* forces) {
    told_.answered = task_.result();
    if (told_.answered && forces) end_with(*forces);
    told_.evaluations = energy_.evaluations();
    if (so_far_) so_far_->reset();
    if (!told_.answered || !std::isfinite(value_) || !loose_.is_tissue(u_) || is_flung()) {
      if (touch_.cells() > 0 && !loose_.whole()) return step_without();
      told_.lost = true;
      const bool stood = std::ranges::all_of(state_.velocities, [](double v) { return v == 0.0; });
      give_up(state_);
      // From where it has stood still since the last step none leads on, as of tissue that is
      // inside out while its body lies on something. Letting go as a held one does (step_without),
      // it would fall through that.
      Eigen::Map<VectorX> kept(state_.displacements.data(), n_);
      if (loose_.whole() && stood && told_.answered) kept = loose_.as_at_rest(kept);
      return std::move(told_);
    }
    for (Eigen::Index row = 0; row < forces_.size(); row += 3)
      told_.forces.push_back(forces_.segment<3>(row));
    solver_.finish(u_, warp_, held_, released_, state_);
    Eigen::Map<VectorX>(state_.loads.data(), n_) = loads();
    if (so_far_) *so_far_ = StepSoFar{u_, stood_, rotations_, energy_.strains()};
    state_.rotations = std::move(rotations_);
    return std::move(told_);
  }

 private:
  using Forces = std::optional<VectorX>;

  /// For forces on the cells, which lie at `free` without them.
  auto ask(VectorX free, MatrixX more = {}, bool last = false) {
    return questions_.ask(TouchQuestion{std::move(free), std::move(more), share_, last});
  }

  /// False: the conditions had no answer.
  Task<bool> run() {
    const double farthest = touch_.begin(touch_.displaced(u_));
    if (!std::isfinite(farthest)) co_return false;
    // What is asked for in metres is a mistake: no number of parts brings it near.
    const auto parts = static_cast<int>(
        std::clamp(std::ceil(farthest / kLongestWay), 1.0, kFarthest / kLongestWay));
    const FiniteOptions& options = solver_.options_;
    const int most = released_ > 0 ? options.iterations_released : options.iterations;
    for (int part = 1; part <= parts; ++part) {
      share_ = static_cast<double>(part) / parts;
      Start still;
      if (part == 1 && options.dynamic && !goes_on_) {
        // Bodies that share their forces begin alike: one that stood while the others went would
        // have to be met anew.
        if (!shared_) still = {u_, forces_, y_};
        u_ = solver_.coming(state_);
      }
      if (const bool done = co_await start_here(); !done) co_return false;
      told_.iterations = 0;
      if (const bool done = co_await descend(most, std::move(still)); !done) co_return false;
    }
    told_.energy = value_;
    stood_ = forces_;
    if (told_.converged && !shared_) co_return true;
    co_return co_await take_stock();
  }

  /// Whether what nothing holds is about to be flung away: the step of a free body came nowhere
  /// near to rest, or a piece has swelled or shrunk as no tissue does.
  bool is_flung() const {
    if (loose_.whole() && touch_.cells() > 0 && told_.residual > kMostResidual) return true;
    return loose_.any_swollen(*solver_.body_, u_);
  }

  /// The last step is by the forces that all bodies have come to: moved by others than its
  /// neighbours, it would gain or lose what these lose or gain of momentum. What a held body gains
  /// of it the hold takes, and it has come to rest as far as it iterates. It isn't evaluated where
  /// the model has shown on a much steeper way of this step that it foresees what a way gains.
  void end_with(const VectorX& forces) {
    forces_ = forces;
    if (z_.size() == 0 || touch_.cells() == 0) return;
    if (loose_.empty() && told_.converged) return;
    VectorX load = VectorX::Zero(n_);
    touch_.add_loads(forces, load);
    Way way{touch_.answer_to(forces) - z_, forces, load, {}};
    way.work = load.dot(way.p);
    way.slope = g_.dot(way.p) - way.work;
    stood_ = forces;
    if (!(way.slope < 0.0)) return;
    if (-way.slope <= kMuchLess * foreseen_ && share_of_move(way.p) == 1.0) {
      u_ = gone(way.p);
      return;
    }
    VectorX next, next_g;
    double next_value = value_;
    if (search(way, next, next_value, next_g) > 0.0) {
      u_ = std::move(next);
      value_ = next_value;
    }
  }

  /// Where tools ask for what can't be, as of tissue that is inside out: they let go for a step, in
  /// which it makes its way back. Unanswered.
  FiniteStep step_without() {
    for (std::size_t at = 0; at < state_.velocities.size(); ++at)
      if (!loose_.has(at / 3)) state_.velocities[at] = 0.0;
    std::ranges::fill(state_.loads, 0.0);
    state_.steps_since_warp = kStepsAWarp;
    Untouched untouched(solver_.body_->nodes(), &touch_);
    FiniteStep told = solver_.step(untouched, state_, given_);
    told.answered = false;
    return told;
  }

  VectorX loads() const {
    VectorX load = VectorX::Zero(n_);
    if (touch_.cells() > 0) touch_.add_loads(forces_, load);
    return load;
  }

  VectorX first_guess(const VectorX& g) const {
    VectorX z = VectorX::Zero(n_);
    if (g.isZero(0.0)) return z;
    const auto count = static_cast<std::size_t>(n_);
    solver_.precondition(rotations_, {g.data(), count}, {z.data(), count});
    return z;
  }

  /// Displacements that are at rest with these forces on the cells; where the cells have changed
  /// since, with the loads of which the factor makes y.
  struct Start {
    VectorX u, forces, y;
  };
  /// From u_ to where the forces are at rest that the conditions ask for.
  Task<bool> start_here() {
    Forces forces = VectorX();
    if (touch_.cells() == 0) {
      if (y_.size() > 0) move_by(-y_);
    } else if (y_.size() > 0) {
      forces = co_await ask(touch_.displaced(u_ - y_));
      if (!forces) co_return false;
      move_by(touch_.answer_to(*forces) - y_);
    } else {
      forces = co_await ask(touch_.displaced(u_) - touch_.response() * forces_);
      if (!forces) co_return false;
      move_by(touch_.answer_to(*forces - forces_));
    }
    y_.resize(0);
    forces_ = std::move(*forces);
    value_ = energy_.at(u_, &g_);
    co_return true;
  }

  /// After a way from here.
  VectorX gone(const VectorX& way) const {
    return loose_.empty() ? VectorX(u_ + way) : loose_.gone_by(u_, way);
  }
  /// How much of a way no node goes too far on.
  double share_of_move(const VectorX& way) const {
    double farthest = 0.0;
    for (Eigen::Index at = 0; at < n_; at += 3)
      farthest = std::max(farthest, way.segment<3>(at).norm());
    return farthest > kLongestMove ? kLongestMove / farthest : 1.0;
  }
  void move_by(const VectorX& way) { u_ = gone(share_of_move(way) * way); }

  /// Where to, and how the merit E - f . Phi u falls there.
  struct Way {
    VectorX p, forces, load, y;
    double work = 0.0;  // f . Phi p
    double slope = 0.0;
  };

  Task<bool> find_way(const VectorX& z, const SecantPairs& pairs, Way& way) {
    const VectorX down = pairs.apply(g_, z);
    way.load = VectorX::Zero(n_);
    way.y = way.load;
    way.forces.resize(0);
    if (touch_.cells() > 0) {
      MatrixX more = pairs.response_change([&](const VectorX& v) { return touch_.displaced(v); },
                                           touch_.response());
      Forces forces = co_await ask(touch_.displaced(u_ - down), std::move(more));
      if (!forces) co_return false;
      way.forces = std::move(*forces);
      touch_.add_loads(way.forces, way.load);
      way.y = touch_.answer_to(way.forces);
    }
    way.p = pairs.apply(way.load, way.y) - down;
    way.work = way.load.dot(way.p);
    way.slope = g_.dot(way.p) - way.work;
    co_return true;
  }

  /// Begins at `other` instead where less energy is.
  Task<bool> start_at_less(Start other) {
    const VectorX u = u_, g = g_, forces = forces_;
    const double value = value_;
    u_ = std::move(other.u);
    forces_ = std::move(other.forces);
    y_ = std::move(other.y);
    if (const bool done = co_await start_here(); !done) co_return false;
    if (value_ <= value) co_return true;
    u_ = u;
    g_ = g;
    forces_ = forces;
    value_ = value;
    co_return true;
  }

  /// Quasi-Newton steps; from `other`, unless that is empty, if less energy is there. False: the
  /// conditions had no answer.
  Task<bool> descend(int most, Start other) {
    foreseen_ = 0.0;
    SecantPairs pairs;
    VectorX z = first_guess(g_);
    z_.resize(0);
    Way way;
    const int most_of_all = touch_.cells() > 0 ? kMostOfAll : most;
    for (int i = 0; i < most || (i < most_of_all && told_.residual > kUnsettled); ++i) {
      if (i > 0 && turn_on()) {
        pairs.clear();
        z = first_guess(g_);
      }
      if (const bool done = co_await find_way(z, pairs, way); !done) co_return false;
      if (i == 0 && other.u.size() > 0 && !(-0.5 * way.slope <= kSureStart * std::abs(value_))) {
        if (const bool done = co_await start_at_less(std::move(other)); !done) co_return false;
        z = first_guess(g_);
        if (const bool done = co_await find_way(z, pairs, way); !done) co_return false;
      }
      if (!(way.slope < 0.0) && pairs.size() > 0) {
        pairs.clear();
        if (const bool done = co_await find_way(z, pairs, way); !done) co_return false;
      }
      note_residual(-way.slope);
      if (told_.converged || !(way.slope < 0.0)) {
        keep(way);
        z_ = std::move(z);
        co_return true;
      }
      ++told_.iterations;
      VectorX next, next_g;
      double next_value = value_;
      double length = search(way, next, next_value, next_g);
      note_foreseen(way, length, pairs.size() == 0 && pairs.scale() == 1.0);
      if (length < kShortest && pairs.size() > 0) {
        pairs.clear();
        if (const bool done = co_await find_way(z, pairs, way); !done) co_return false;
        length = search(way, next, next_value, next_g);
      }
      // Strained far, tissue is stiffer than its factor at rest. What answers is stiffened, not the
      // way cut short, which would leave the gaps open that the cells are to close. Of a body that
      // nothing holds most of a way is that of its mass, which is as it is.
      if (length == 1.0) pairs.relax();
      const int stiffenings = touch_.cells() == 0 || loose_.whole() ? 0 : kMostStiffenings;
      for (int times = 0; length < kFarEnough && times < stiffenings; ++times) {
        pairs.stiffen(std::max(length, kLeastShare));
        if (const bool done = co_await find_way(z, pairs, way); !done) co_return false;
        length = search(way, next, next_value, next_g);
      }
      keep(way);
      if (length == 0.0) co_return true;
      VectorX next_z = first_guess(next_g);
      // What a factor in single precision makes of less is noise, and so is a step by it.
      const bool at_floor = (next_z - z).norm() < kLeastChange * pairs.scale() * next_z.norm();
      if (!at_floor) pairs.add(next - u_, next_g - g_, next_z - z);
      u_ = std::move(next);
      g_ = std::move(next_g);
      value_ = next_value;
      z = std::move(next_z);
      if (length < 1.0) {
        // A way that was cut short leaves gaps open.
        if (const bool done = co_await start_here(); !done) co_return false;
        z = first_guess(g_);
      }
      if (at_floor) break;
    }
    z_ = std::move(z);
    co_return true;
  }

  void keep(const Way& way) { forces_ = way.forces; }

  /// After a search along a way, by the factor as it is or otherwise. The model makes a whole way
  /// gain half of its slope. A way cut short says that it errs.
  void note_foreseen(const Way& way, double length, bool by_factor) {
    if (length < 1.0)
      foreseen_ = 0.0;
    else if (by_factor)
      foreseen_ = std::abs(gained_ / way.slope - 0.5) <= 0.5 * kForeseen ? -way.slope : 0.0;
  }

  /// Loose pieces of which one has turned on since its factor was warped are warped anew: what that
  /// takes for a turn of it strains it by as much as it has turned. True: they were.
  bool turn_on() {
    if (loose_.empty()) return false;
    const std::vector<Mat3> now = loose_.rotations(*solver_.body_, u_);
    const auto has_turned = [&](std::size_t piece) {
      const auto first = static_cast<std::size_t>(loose_.pieces()[piece].front());
      return !(Eigen::AngleAxisd(now[piece] * rotation_of(rotations_, first).transpose()).angle() <
               kLeastTurn);
    };
    bool any = false;
    for (std::size_t piece = 0; piece < now.size() && !any; ++piece) any = has_turned(piece);
    if (!any) return false;
    loose_.set(now, rotations_);
    touch_.turn(rotations_);
    foreseen_ = 0.0;
    return true;
  }

  /// How far along the way the merit falls enough; 0: nowhere.
  double search(const Way& way, VectorX& next, double& next_value, VectorX& next_g) {
    const double slack = std::min(kSlack, solver_.options_.decrement);
    double length = share_of_move(way.p);
    for (int trial = 0; trial < kMostTrials; ++trial) {
      next = gone(length * way.p);
      next_value = energy_.at(next, &next_g);
      const double work = loose_.empty() ? length * way.work : way.load.dot(next - u_);
      const double gained = next_value - value_ - work;
      gained_ = gained;
      if (gained <= kArmijo * length * way.slope + slack * std::abs(value_)) return length;
      const double fit = -0.5 * way.slope * length * length / (gained - length * way.slope);
      length = std::isfinite(fit) ? std::clamp(fit, 0.1 * length, 0.5 * length) : 0.1 * length;
    }
    return 0.0;
  }

  void note_residual(double decrement) {
    told_.residual = 0.5 * decrement > noise_ ? residual_of(0.5 * decrement, value_) : 0.0;
    told_.converged = told_.residual <= solver_.options_.decrement;
  }

  /// Forces, and what a further step would gain, where the last one ended.
  Task<bool> take_stock() {
    if (z_.size() == 0) co_return true;  // it found no way on
    Forces forces = VectorX();
    const VectorX at_cells = touch_.displaced(z_);
    double decrement = g_.dot(z_);
    if (touch_.cells() > 0) {
      forces = co_await ask(touch_.displaced(u_) - at_cells, {}, true);
      if (!forces) co_return false;
      decrement += forces->dot(touch_.response() * *forces) - 2.0 * forces->dot(at_cells);
    }
    note_residual(decrement);
    forces_ = std::move(*forces);
    co_return true;
  }

  const FiniteSolver& solver_;
  const LoosePieces& loose_;
  FiniteTouch& touch_;
  FiniteState& state_;
  BodyLoad given_, load_;  // less what pulls at pieces out of view
  std::optional<StepSoFar>* so_far_;
  bool shared_ = false;
  bool goes_on_ = false, warp_ = false;
  NodalRotations rotations_;
  StepEnergy energy_;
  Eigen::Index n_ = 0;
  double noise_ = 0.0;
  std::int32_t held_ = 0, released_ = 0;
  FiniteStep told_;
  VectorX u_, forces_, y_;  // as Start
  double share_ = 1.0;      // of the way that is asked for
  VectorX g_, z_;
  VectorX stood_;          // forces_ as the last way had them
  double gained_ = 0.0;    // by the last search, of the merit
  double foreseen_ = 0.0;  // slope of a way that gained what the model makes it gain; 0: none did
  double value_ = 0.0;
  Questions<TouchQuestion, Forces> questions_;
  Task<bool> task_;
};

TouchedStep::TouchedStep(const FiniteSolver& solver, FiniteTouch& touch, FiniteState& state,
                         const BodyLoad& load, std::optional<StepSoFar>* so_far, bool shared)
    : descent_(std::make_unique<Descent>(solver, touch, state, load, so_far, shared)) {}
TouchedStep::TouchedStep(TouchedStep&&) noexcept = default;
TouchedStep& TouchedStep::operator=(TouchedStep&&) noexcept = default;
TouchedStep::~TouchedStep() = default;

const TouchQuestion* TouchedStep::question() const {
  return descent_->question();
}
void TouchedStep::answer(std::optional<VectorX> forces) {
  descent_->answer(std::move(forces));
}
FiniteStep TouchedStep::end(const VectorX* forces) {
  return descent_->end(forces);
}

}  // namespace viscera
