#include "haptics/hive_tissue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

/// A hive is begun when the tool is this near [radii of the hive], so that it is there at the
/// touch.
constexpr double kNear = 1.0;
/// The next one is begun when the pattern's rim has come this far out of the usable part.
constexpr double kWornOut = 0.6;
/// It stands where the tool will be so much later [s], at most so far ahead [of the usable radius].
constexpr double kAhead = 0.02, kFarthestAhead = 0.5;
/// Over this time the force passes to the new hive [s].
constexpr double kBlend = 0.016;
/// For the slope of the force: the ball this much deeper [of its radius].
constexpr double kNudge = 1e-4;

/// The scene's own nearest place is taken where it is nearer by this much [m].
constexpr double kNearer = 0.5e-3;
/// A tool this far off doesn't touch in the next ticks [m].
constexpr double kTouching = 2e-3;

/// A frame older than this has stalled: what moved then stands still [ticks].
constexpr double kLongestFrames = 34.0;
/// What a snapshot changes is shown over the time that the one before it lasted, within these: the
/// shortest frame that a scene may have, so that it is shown before the next one comes, and a stall
/// after which nobody expects the scene to have gone on slowly [s].
constexpr double kShortestEasing = 0.004, kLongestEasing = 0.25;

Result<void> check_prony(std::span<const PronyTerm> terms) {
  Error mistakes;
  double sum = 0.0;
  if (terms.size() > PronyForce::kMostTerms)
    mistakes.messages.push_back(fmt::format("prony: found {} terms, expected at most {}",
                                            terms.size(), PronyForce::kMostTerms));
  for (const PronyTerm& term : terms) {
    sum += term.g;
    if (!(term.g > 0.0 && term.tau > 0.0 && std::isfinite(term.tau)))
      mistakes.messages.push_back(fmt::format(
          "prony: found g {:g} and tau {:g} s, expected both above 0", term.g, term.tau));
  }
  if (!(sum < 1.0))
    mistakes.messages.push_back(
        fmt::format("prony: found shares g of {:g} together, expected less than 1", sum));
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

CellWays ways_of(const HiveTissueSettings& settings) {
  return settings.model == HyperelasticModel::kLinear &&
                 settings.hive.formulation == HiveFormulation::kSubtracted
             ? CellWays::kOwnNormals
             : CellWays::kTogether;
}

double smooth(double share) {
  return share * share * (3.0 - 2.0 * share);
}

}  // namespace

HiveTissueFigures& HiveTissueFigures::operator+=(const HiveTissueFigures& other) noexcept {
  hives += other.hives;
  refused += other.refused;
  searches += other.searches;
  uncovered += other.uncovered;
  newton_steps += other.newton_steps;
  tangent_answers += other.tangent_answers;
  deadline_misses += other.deadline_misses;
  linear_answers += other.linear_answers;
  if (other.last_refusal != HiveVerdict::kSound) last_refusal = other.last_refusal;
  return *this;
}

Result<std::unique_ptr<HiveTissue>> HiveTissue::create(const HiveBody& body,
                                                       const HiveTissueSettings& settings) {
  if (!(settings.tool_radius > 0.0))
    return failure(fmt::format("haptic tool: found a tip of radius {:g} m, expected a ball",
                               settings.tool_radius));
  if (auto sound = check_prony(settings.prony); !sound) return std::unexpected(sound.error());
  std::optional<NonlinearHive> nonlinear;
  if (settings.model != HyperelasticModel::kLinear) {
    if (settings.hive.formulation == HiveFormulation::kPaper)
      return failure(
          fmt::format("material model: found {} with formulation \"paper\", expected linear: "
                      "the published nodes have no cells to add to",
                      name_of(settings.model)));
    NonlinearSettings beyond;
    beyond.model = settings.model;
    beyond.material = settings.hive.material;
    beyond.rings = settings.rings;
    beyond.nodes = settings.nonlinear_nodes;
    auto made = NonlinearHive::create(beyond);
    if (!made) return std::unexpected(made.error());
    nonlinear = std::move(*made);
  }
  const int cells = 1 + 3 * settings.rings * (settings.rings + 1);
  auto hives = Hive::create_some(body, settings.hive, cells, kHives);
  if (!hives) return std::unexpected(hives.error());
  return std::unique_ptr<HiveTissue>(
      new HiveTissue(body, settings, std::move(*hives), std::move(nonlinear)));
}

HiveTissue::HiveTissue(const HiveBody& body, const HiveTissueSettings& settings,
                       std::vector<Hive> hives, std::optional<NonlinearHive> nonlinear)
    : body_(body),
      settings_(settings),
      foot_(settings.tool_radius, settings.rings, ways_of(settings)),
      hives_(std::move(hives)),
      nonlinear_(std::move(nonlinear)),
      prony_(settings.prony),
      nudged_(foot_.cells().size()),
      builder_(settings.building) {}

/// [s] of one tick.
double tick_of(const ToolMotion& motion, double dt) {
  return dt / static_cast<double>(motion.ticks);
}

/// How far the tissue went by its own velocity since the snapshot, in ticks of `dt` [m].
Vec3 moved_since(const TissueSnapshot& scene, std::uint64_t tick, double dt) {
  const double ticks = static_cast<double>(tick) - static_cast<double>(scene.tick);
  return std::clamp(ticks, 0.0, kLongestFrames) * dt * scene.velocity;
}

/// The tip as it is from tissue at rest, by this snapshot alone.
Vec3 HiveTissue::seen_from_rest(const TissueSnapshot& scene, const ToolMotion& motion,
                                double dt) const noexcept {
  const Vec3 moved = moved_since(scene, motion.tick, tick_of(motion, dt));
  return scene.pose.to_local(motion.pose.position - moved);
}

/// Takes the newest snapshot, if there is one; says whether. Its frame may turn, but what it is
/// eased by is the shift at the tool: organs breathe, they don't spin.
bool HiveTissue::take_snapshot(const ToolMotion& motion, double dt) noexcept {
  since_told_ += dt;
  const bool ease = told_ && nearest_.on_surface();
  Vec3 before = Vec3::Zero();
  if (ease) before = seen_from_rest(snapshots_.front(), motion, dt) + unshown_;
  const bool fresh = snapshots_.update();
  if (fresh) {
    // Half of a blend is told from neither: what it had come nearer to stands for it.
    if (hold_.share > 0.5) hold_.from = hold_.to;
    hold_.to = snapshots_.front().hold;
    if (!ease) hold_.from = hold_.to;
    unshown_ = ease ? Vec3(before - seen_from_rest(snapshots_.front(), motion, dt)) : Vec3::Zero();
    // A frame that follows soon after a late one doesn't hurry what that one began.
    easing_left_ = std::clamp(std::max(since_told_, easing_left_), kShortestEasing, kLongestEasing);
    easing_ = easing_left_;
    since_told_ = 0.0;
  }
  told_ = fresh || told_;
  shown_now_ = easing_left_ > dt ? Vec3(dt / easing_left_ * unshown_) : unshown_;
  unshown_ -= shown_now_;
  easing_left_ -= dt;
  hold_.share = easing_ > 0.0 ? std::clamp(1.0 - easing_left_ / easing_, 0.0, 1.0) : 1.0;
  return fresh;
}

bool HiveTissue::find_nearest(const TissueSnapshot& scene, const Vec3& tip, bool fresh) noexcept {
  const auto off = [&](const SurfaceSpot& spot) { return (tip - spot.position).norm(); };
  const auto walk = [&](SurfaceSpot& spot) {
    return body_.surface->walk(tip, reach(), spot) == WalkEnd::kFound;
  };
  const bool near = nearest_.on_surface() && walk(nearest_);
  if (!near) nearest_.point.triangle = -1;
  // The walk may end in a hollow while the tool comes near elsewhere: the scene's search is global.
  const bool pressing = near && foot_.standing() && foot_.depth() > 0.0;
  if (scene.nearest.triangle < 0 || !body_.surface->has(scene.nearest) ||
      (near && (pressing || !fresh)))
    return near;
  SurfaceSpot other = body_.surface->at(scene.nearest);
  if (!walk(other)) return near;
  if (near && off(other) > off(nearest_) - kNearer) return true;
  ++figures_.searches;
  nearest_ = other;
  foot_.forget();
  return true;
}

bool HiveTissue::find_foot(const TissueSnapshot& scene, const Vec3& tip, bool fresh) noexcept {
  if (!find_nearest(scene, tip, fresh)) {
    foot_.forget();
    return false;
  }
  const Vec3 away = tip - nearest_.position;
  const double height = away.dot(nearest_.normal) < 0.0 ? -away.norm() : away.norm();
  const double depth = settings_.tool_radius - height;
  // In the air the nearest place will do; and where the smooth foot has left the tool (a fold, an
  // edge that it went around) it begins again there.
  const bool close = depth > -kTouching;
  const double stray = settings_.tool_radius + std::max(0.0, depth);
  const auto followed = [&] {
    return foot_.follow(*body_.surface, tip, reach()) && std::abs(foot_.depth() - depth) < stray;
  };
  if (close && foot_.standing() && followed()) return true;
  foot_.start(nearest_, tip);
  if (close && !followed()) foot_.start(nearest_, tip);
  return true;
}

void HiveTissue::renew_hive(const Vec3& velocity) noexcept {
  const auto hive = [&](int i) -> Hive& { return hives_[static_cast<std::size_t>(i)]; };
  // One change at a time, unless the running hive has nothing to say any more.
  const bool may_change = share_ >= 1.0 || !covered_;
  if (may_change && builder_.ready()) {
    const HiveVerdict verdict = builder_.take();
    if (verdict == HiveVerdict::kSound) {
      ++figures_.hives;
      before_ = now_;
      now_ = next_;
      share_ = 0.0;
    } else {
      ++figures_.refused;
      figures_.last_refusal = verdict;
    }
    next_ = -1;
  }
  if (builder_.busy()) return;
  SurfaceSpot wanted = foot_.spot();
  if (now_ >= 0) {
    const double usable = hive(now_).usable_radius();
    const double off = (foot_.spot().position - hive(now_).centre().position).norm();
    if (off + foot_.across() < kWornOut * usable) return;
    Vec3 ahead = kAhead * (velocity - velocity.dot(foot_.up()) * foot_.up());
    const double far = ahead.norm(), most = kFarthestAhead * usable;
    if (far > most) ahead *= most / far;
    if (body_.surface->straight(ahead, wanted) != WalkEnd::kFound) wanted = foot_.spot();
    // A tool that stays where its hive can't cover it gains nothing from another there.
    if ((wanted.position - hive(now_).centre().position).norm() < 0.1 * usable) return;
  }
  for (next_ = 0; next_ == now_ || next_ == before_;) ++next_;
  builder_.request(hive(next_), wanted);
}

Vec3 HiveTissue::displacement(const SurfaceSpot& spot) const noexcept {
  const double s = smooth(share_);
  Vec3 sum = Vec3::Zero();
  if (before_ >= 0 && s < 1.0)
    sum += (1.0 - s) * hives_[static_cast<std::size_t>(before_)].displacement(spot);
  if (now_ >= 0) sum += s * hives_[static_cast<std::size_t>(now_)].displacement(spot);
  return sum;
}

HiveForce HiveTissue::press(Hive& hive, double& stiffness) noexcept {
  HiveForce result;
  result.verdict = hive.seat(foot_.cells(), hold_);
  if (result.verdict != HiveVerdict::kSound) return result;
  const double nudge = kNudge * settings_.tool_radius;
  for (std::size_t k = 0; k < nudged_.size(); ++k)
    nudged_[k] = foot_.depths()[k] + foot_.deepening(k) * nudge;
  const HiveForce deeper = hive.press(nudged_);
  result = hive.press(foot_.depths());
  if (deeper.verdict == HiveVerdict::kSound && result.verdict == HiveVerdict::kSound)
    stiffness = std::max(0.0, (deeper.force - result.force).dot(foot_.up()) / nudge);
  result.force = push_of(hive.cell_forces()) + hive.drawn_aside();
  return result;
}

/// On the tool, of the cells' forces along their direction [N].
Vec3 HiveTissue::push_of(std::span<const double> forces) const noexcept {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < forces.size(); ++k) sum += forces[k] * foot_.pushes()[k];
  return sum;
}

/// Both hives' cells under one grid; false where it has no answer.
bool HiveTissue::answer_beyond_linear(Clock::time_point began, const HoldBlend& held, double before,
                                      double now, Answer& all) noexcept {
  std::array<NonlinearHive::Share, 2> shares;
  std::size_t count = 0;
  for (const auto& [which, weight] : {std::pair(before_, before), std::pair(now_, now)}) {
    if (which < 0 || weight <= 0.0) continue;
    Hive& hive = hives_[static_cast<std::size_t>(which)];
    if (hive.seat(foot_.cells(), hold_) == HiveVerdict::kSound) shares[count++] = {&hive, weight};
  }
  if (count == 0) return false;
  struct Deadline {
    Clock::time_point at;
  } deadline{began + std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(settings_.deadline))};
  TimeIsUp time;
  if (settings_.building == HiveBuilding::kOnAThread && settings_.deadline > 0.0)
    time = {[](void* user) { return Clock::now() >= static_cast<Deadline*>(user)->at; }, &deadline};
  const NonlinearForce one = nonlinear_->press({shares.data(), count}, foot_.depths(),
                                               foot_.across(), settings_.tool_radius, time);
  figures_.newton_steps += static_cast<std::uint64_t>(one.steps);
  if (one.hive.verdict != HiveVerdict::kSound) {
    ++figures_.linear_answers;
    return false;
  }
  figures_.tangent_answers += one.by_tangent;
  figures_.deadline_misses += one.out_of_time;
  for (std::size_t i = 0; i < count; ++i) {
    all.covered += shares[i].weight;
    all.force +=
        shares[i].weight * (push_of(shares[i].hive->cell_forces()) + shares[i].hive->drawn_aside());
    all.by_hold += shares[i].weight * shares[i].hive->work_of_hold(held);
  }
  all.stiffness = one.stiffness;
  all.energy = one.hive.energy;
  return true;
}

/// Of the running hive and the one before it; `held`: by what others held the tick before.
HiveTissue::Answer HiveTissue::answer(Clock::time_point began, const HoldBlend& held) noexcept {
  const double s = smooth(share_);
  Answer all;
  if (!nonlinear_ || !answer_beyond_linear(began, held, 1.0 - s, s, all)) {
    const auto add = [&](int which, double weight) {
      if (which < 0 || weight <= 0.0) return;
      double slope = 0.0;
      Hive& hive = hives_[static_cast<std::size_t>(which)];
      const HiveForce one = press(hive, slope);
      if (one.verdict != HiveVerdict::kSound) {
        ++figures_.refused;
        figures_.last_refusal = one.verdict;
        return;
      }
      all.covered += weight;
      all.force += weight * one.force;
      all.stiffness += weight * slope;
      all.energy += weight * one.energy;
      all.by_hold += weight * hive.work_of_hold(held);
    };
    add(before_, 1.0 - s);
    add(now_, s);
  }
  // Where there was no hive before, the force grows from nothing; where one of two gave no answer,
  // the other speaks for both.
  if (all.covered > 0.0 && before_ >= 0) {
    all.force /= all.covered;
    all.stiffness /= all.covered;
    all.energy /= all.covered;
    all.by_hold /= all.covered;
  }
  return all;
}

/// What the Prony series makes of the elastic force. What the tissue stores then isn't known.
void HiveTissue::relax(TactileForce& felt, double dt) noexcept {
  // Without a hive nobody knows what it would relax from.
  if (prony_.empty() || !covered_) return;
  const double elastic = felt.force.norm();
  const double force = prony_.update(elastic, dt);
  felt.force *= elastic > 0.0 ? force / elastic : 0.0;
  felt.stiffness *= prony_.over(dt);
  felt.supplied *= elastic > 0.0 ? force / elastic : 0.0;
  felt.energy = -1.0;
  felt.touching = felt.touching && force > 0.0;
}

void HiveTissue::stand_at(const SurfacePoint& place) {
  if (place.triangle < 0) return;
  if (const HiveVerdict verdict = hives_[0].build(body_.surface->at(place));
      verdict != HiveVerdict::kSound) {
    ++figures_.refused;
    figures_.last_refusal = verdict;
    return;
  }
  ++figures_.hives;
  now_ = 0;
}

void HiveTissue::go_on_from(const HiveTissue& before) noexcept {
  prony_ = before.prony_;
  const HiveTissueFigures own = figures_;
  figures_ = before.figures_;
  figures_ += own;
}

TactileForce HiveTissue::respond(const ToolMotion& motion, double dt) noexcept {
  TactileForce felt = respond_at_once(motion, dt, Clock::now());
  relax(felt, dt);
  return felt;
}

TactileForce HiveTissue::respond_at_once(const ToolMotion& motion, double dt,
                                         Clock::time_point began) noexcept {
  TactileForce felt;
  const HoldBlend held = hold_;
  const bool fresh = take_snapshot(motion, dt);
  if (!told_) return felt;
  const TissueSnapshot& scene = snapshots_.front();
  const Vec3 moved = moved_since(scene, motion.tick, tick_of(motion, dt));
  const Vec3 tip = scene.pose.to_local(motion.pose.position - moved) + unshown_;
  const Vec3 velocity = scene.pose.direction_to_local(motion.velocity - scene.velocity);
  share_ = before_ < 0 && now_ < 0 ? 1.0 : std::min(1.0, share_ + dt / kBlend);
  if (share_ >= 1.0) before_ = -1;
  if (!find_foot(scene, tip, fresh)) return felt;
  if (foot_.depth() < -kNear * settings_.hive.radius) return felt;
  foot_.lay_cells(*body_.surface);
  renew_hive(velocity);
  if (foot_.depth() <= 0.0) {
    covered_ = true;  // as far as anybody knows
    if (nonlinear_) nonlinear_->release();
    return felt;
  }

  const Answer all = answer(began, held);
  covered_ = all.covered > 0.0;
  if (!covered_) {
    ++figures_.uncovered;
    felt.energy = 0.0;
    return felt;
  }
  felt.energy = all.energy;
  felt.force = scene.pose.direction_to_world(all.force);
  const Vec3 up = scene.pose.direction_to_world(foot_.up());
  felt.stiffness = all.stiffness * up * up.transpose();
  const bool moving = moved_since(scene, motion.tick + 1, tick_of(motion, dt)) != moved;
  const Vec3 shift =
      (moving ? dt : 0.0) * scene.velocity + scene.pose.direction_to_world(shown_now_);
  felt.supplied = std::max(0.0, felt.force.dot(shift) + all.by_hold);
  felt.touching = all.force.squaredNorm() > 0.0;
  return felt;
}

HiveTissue::State HiveTissue::state() const {
  State state;
  state.snapshots = snapshots_.state();
  state.told = told_;
  state.since_told = since_told_;
  state.unshown = unshown_;
  state.shown_now = shown_now_;
  state.easing_left = easing_left_;
  state.easing = easing_;
  state.hold = hold_;
  state.nearest = nearest_;
  state.foot = foot_.state();
  for (int i = 0; i < static_cast<int>(kHives); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool used = i == now_ || i == before_ || i == next_;
    state.hives[at] = used ? hives_[at].state() : hives_[at].idle_state();
  }
  state.now = now_;
  state.before = before_;
  state.next = next_;
  state.share = share_;
  state.covered = covered_;
  if (nonlinear_) state.nonlinear = nonlinear_->state();
  state.prony = prony_.state();
  state.figures = figures_;
  state.builder = builder_.state();
  return state;
}

void HiveTissue::restore(State state) {
  snapshots_.restore(std::move(state.snapshots));
  told_ = state.told;
  since_told_ = state.since_told;
  unshown_ = state.unshown;
  shown_now_ = state.shown_now;
  easing_left_ = state.easing_left;
  easing_ = state.easing;
  hold_ = state.hold;
  nearest_ = state.nearest;
  foot_.restore(std::move(state.foot));
  for (std::size_t i = 0; i < kHives; ++i) hives_[i].restore(state.hives[i]);
  now_ = state.now;
  before_ = state.before;
  next_ = state.next;
  share_ = state.share;
  covered_ = state.covered;
  if (nonlinear_) nonlinear_->restore(*state.nonlinear);
  prony_.restore(state.prony);
  figures_ = state.figures;
  builder_.restore(state.builder, next_ < 0 ? nullptr : &hives_[static_cast<std::size_t>(next_)]);
}

bool HiveTissue::fits(const State& state) const {
  for (const TissueSnapshot& one : state.snapshots.slots)
    if (!body_.surface->has(one.nearest) || !one.hold.is_sound()) return false;
  for (std::size_t i = 0; i < kHives; ++i)
    if (!hives_[i].fits(state.hives[i])) return false;
  // No hive plays two parts.
  std::array<int, kHives> parts{};
  for (const int one : {state.now, state.before, state.next}) {
    if (one < -1 || one >= static_cast<int>(kHives)) return false;
    if (one >= 0 && ++parts[static_cast<std::size_t>(one)] > 1) return false;
  }
  if (state.nonlinear.has_value() != nonlinear_.has_value()) return false;
  if (nonlinear_ && !nonlinear_->fits(*state.nonlinear)) return false;
  return TripleBuffer<TissueSnapshot>::fits(state.snapshots) && state.hold.is_sound() &&
         body_.surface->has(state.nearest.point) && foot_.fits(state.foot, *body_.surface) &&
         prony_.fits(state.prony) && builder_.fits(state.builder) &&
         state.builder.busy == (state.next >= 0) &&
         state.figures.last_refusal >= HiveVerdict::kSound &&
         state.figures.last_refusal <= HiveVerdict::kNotBuilt;
}

}  // namespace viscera
