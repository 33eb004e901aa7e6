// One organ under one ball-ended tool, at 1 kHz: hives that travel with the tip (LPAFF).
//
// Each tick: the newest snapshot → the tool's foot on the surface → cells under the ball → the
// running hive condensed to them → force. When the foot nears the edge of what the hive answers
// well, the next hive is built about where the tool is going; once it is there, the force passes
// from one to the other over some ticks, so that nothing is felt of the change.
//
// Tissue beyond linear: what finite strains change rides on the tool, not on a hive
// (nonlinear_hive.h), so it knows nothing of that change. A Prony series then relaxes the force
// along the foot's normal; what it remembers goes with the tool too.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "haptics/hive_builder.h"
#include "haptics/tactile_model.h"
#include "haptics/tissue_snapshot.h"
#include "haptics/tool_foot.h"
#include "haptics/triple_buffer.h"
#include "kernels/hive/nonlinear_hive.h"
#include "kernels/hive/prony.h"

namespace viscera {

struct HiveTissueSettings {
  HiveSettings hive;
  double tool_radius = 0.0;  ///< of the ball [m]
  int rings = 2;             ///< of its pattern of cells; 2: 19 cells
  HyperelasticModel model = HyperelasticModel::kLinear;
  int nonlinear_nodes = 80;  ///< of the grid, where the model isn't linear
  /// After so much of a tick no further Newton step is begun [s]; 0, and in lockstep: only their
  /// number counts.
  double deadline = 0.4e-3;
  std::vector<PronyTerm> prony;
  HiveBuilding building = HiveBuilding::kOnAThread;
};

/// Counters since the start; read by any thread after the loop, or by the servo thread.
struct HiveTissueFigures {
  std::uint64_t hives = 0;      ///< built
  std::uint64_t refused = 0;    ///< that couldn't answer: see last_refusal
  std::uint64_t searches = 0;   ///< walks that began anew at the scene's own place
  std::uint64_t uncovered = 0;  ///< ticks in contact without a hive: no force
  HiveVerdict last_refusal = HiveVerdict::kSound;
  // Of tissue beyond linear:
  std::uint64_t newton_steps = 0;
  std::uint64_t tangent_answers = 0;  ///< ticks answered by the last good tangent
  std::uint64_t deadline_misses = 0;  ///< of them, because time was up
  std::uint64_t linear_answers = 0;   ///< ticks in which there was none: the linear hive's answer

  HiveTissueFigures& operator+=(const HiveTissueFigures& other) noexcept;
  static constexpr auto fields() {
    using F = HiveTissueFigures;
    return std::tuple(
        field("hives", &F::hives), field("refused", &F::refused), field("searches", &F::searches),
        field("uncovered", &F::uncovered), field("last_refusal", &F::last_refusal),
        field("newton_steps", &F::newton_steps), field("tangent_answers", &F::tangent_answers),
        field("deadline_misses", &F::deadline_misses), field("linear_answers", &F::linear_answers));
  }
};
static_assert(fields_cover<HiveTissueFigures>());

class HiveTissue final : public TactileModel {
 public:
  /// `body`, and what it points at, outlive it. Fails as Hive::create does, and for a tool without
  /// size, material that isn't one, and a model beyond linear on the published formulation.
  static Result<std::unique_ptr<HiveTissue>> create(const HiveBody& body,
                                                    const HiveTissueSettings& settings);

  /// The frame's side: fill back(), publish().
  TripleBuffer<TissueSnapshot>& snapshots() { return snapshots_; }

  TactileForce respond(const ToolMotion& motion, double dt) noexcept override;

  /// Before the first tick: the hive about this place is built at once. Milliseconds.
  void stand_at(const SurfacePoint& place);
  /// Likewise: of a body that `before`'s has become. What relaxes goes on from there, and counters
  /// go on.
  void go_on_from(const HiveTissue& before) noexcept;

  const HiveTissueSettings& settings() const { return settings_; }
  const HiveTissueFigures& figures() const { return figures_; }
  /// Displacement of the surface at a rest place under the last tick's force [m].
  Vec3 displacement(const SurfaceSpot& spot) const noexcept;
  /// Some hive answered in the last tick, if the tool touched; false: it gave no force.
  bool covers() const { return covered_; }
  /// Surface farther than this from the tool isn't followed [m].
  double reach() const { return 3.0 * settings_.hive.radius; }
  /// The running hive; null before the first.
  const Hive* hive() const { return now_ < 0 ? nullptr : &hives_[static_cast<std::size_t>(now_)]; }
  const ToolFoot& foot() const { return foot_; }

  static constexpr std::size_t kHives = 3;  ///< running, the one before it, the next
  /// What the next tick goes on from. Of hives it holds where they stand, not what they consist of.
  struct State {
    TripleBuffer<TissueSnapshot>::State snapshots;
    bool told = false;        ///< a snapshot has come
    double since_told = 0.0;  ///< [s]
    /// What a new snapshot changed at the tool and hasn't been shown yet: it goes to zero over the
    /// time that frames take, so that a scene that jumps or is late isn't felt as a blow.
    Vec3 unshown = Vec3::Zero(), shown_now = Vec3::Zero();  ///< [m] in the organ's frame
    double easing_left = 0.0, easing = 0.0;                 ///< of how much [s]
    HoldBlend hold;                                         ///< of others, eased likewise
    SurfaceSpot nearest;                                    ///< to the tool
    ToolFoot::State foot;
    std::array<Hive::State, kHives> hives;
    int now = -1, before = -1, next = -1;  ///< of the hives; -1: none
    double share = 1.0;                    ///< of the running hive in the force
    bool covered = true;                   ///< some hive answered the last tick in contact
    std::optional<NonlinearHive::State> nonlinear;
    PronyForce::State prony;
    HiveTissueFigures figures;
    HiveBuilder::State builder;
    static constexpr auto fields() {
      return std::tuple(field("snapshots", &State::snapshots), field("told", &State::told),
                        field("since_told", &State::since_told), field("unshown", &State::unshown),
                        field("shown_now", &State::shown_now),
                        field("easing_left", &State::easing_left), field("easing", &State::easing),
                        field("hold", &State::hold), field("nearest", &State::nearest),
                        field("foot", &State::foot), field("hives", &State::hives),
                        field("now", &State::now), field("before", &State::before),
                        field("next", &State::next), field("share", &State::share),
                        field("covered", &State::covered), field("nonlinear", &State::nonlinear),
                        field("prony", &State::prony), field("figures", &State::figures),
                        field("builder", &State::builder));
    }
  };
  /// In lockstep, between ticks. On the wall clock there is no going back: nothing fits then.
  State state() const;
  /// Builds the hives that don't stand where they should: milliseconds each, and not for a tick.
  void restore(State state);
  bool fits(const State& state) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Answer {
    double covered = 0.0;  ///< weights of the hives that answered
    Vec3 force = Vec3::Zero();
    double stiffness = 0.0, energy = 0.0;
    double by_hold = 0.0;  ///< of the energy, by a hold that has changed
  };
  HiveTissue(const HiveBody& body, const HiveTissueSettings& settings, std::vector<Hive> hives,
             std::optional<NonlinearHive> nonlinear);

  TactileForce respond_at_once(const ToolMotion& motion, double dt,
                               Clock::time_point began) noexcept;
  void relax(TactileForce& felt, double dt) noexcept;
  Answer answer(Clock::time_point began, const HoldBlend& held) noexcept;
  bool answer_beyond_linear(Clock::time_point began, const HoldBlend& held, double before,
                            double now, Answer& all) noexcept;

  Vec3 seen_from_rest(const TissueSnapshot& scene, const ToolMotion& motion,
                      double dt) const noexcept;
  bool take_snapshot(const ToolMotion& motion, double dt) noexcept;
  bool find_nearest(const TissueSnapshot& scene, const Vec3& tip, bool fresh) noexcept;
  bool find_foot(const TissueSnapshot& scene, const Vec3& tip, bool fresh) noexcept;
  void renew_hive(const Vec3& velocity) noexcept;
  HiveForce press(Hive& hive, double& stiffness) noexcept;
  Vec3 push_of(std::span<const double> forces) const noexcept;

  HiveBody body_;
  HiveTissueSettings settings_;
  TripleBuffer<TissueSnapshot> snapshots_;
  bool told_ = false;  // this and the next: see State
  double since_told_ = 0.0;
  Vec3 unshown_ = Vec3::Zero(), shown_now_ = Vec3::Zero();
  double easing_left_ = 0.0, easing_ = 0.0;
  HoldBlend hold_;
  SurfaceSpot nearest_;
  ToolFoot foot_;
  std::vector<Hive> hives_;
  int now_ = -1, before_ = -1, next_ = -1;
  double share_ = 1.0;
  bool covered_ = true;
  std::optional<NonlinearHive> nonlinear_;
  PronyForce prony_;
  HiveTissueFigures figures_;
  std::vector<double> nudged_;
  HiveBuilder builder_;  // last: its thread ends before what it builds
};
static_assert(fields_cover<HiveTissue::State>() && StateOwner<HiveTissue>);

}  // namespace viscera
