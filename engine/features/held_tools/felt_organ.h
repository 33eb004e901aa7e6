// An organ as one hand feels it.
//
// An organ that is cut becomes another body between two frames. The hand goes over to that once the
// new body's hives know where the tool is: the frame's thread makes and publishes, the servo's
// takes, and neither waits for the other. Where no hive can stand, as over the edge of a cut, the
// frame's own force is felt. What either changes at the tool is eased in.
#pragma once

#include <atomic>
#include <memory>
#include <optional>

#include "engine/features/contact/frame_feel.h"
#include "engine/features/contact/tissue_as_met.h"
#include "engine/scene/scene.h"
#include "engine/simulation/world.h"
#include "haptics/hive_tissue.h"

namespace viscera {

/// A body of an organ, and the hives that one tool feels of it.
struct FeltBody {
  std::shared_ptr<const OrganModel> model;
  std::shared_ptr<const WalkableSurface> surface;  ///< that the hives stand on
  bool cut = false;                    ///< it has walls, beside which walks miss what a ball meets
  std::unique_ptr<HiveTissue> tissue;  ///< goes before both, and with it the thread that builds
};

/// Fails, naming the key, where hives can't stand on it. `surface`, where it is known already: of
/// the same body, for another tool; null: made, and left there. `cut`: as FeltBody::cut.
Result<std::unique_ptr<FeltBody>> felt_body(const InstrumentDescription& instrument,
                                            const OrganBody& organ, bool cut, HiveBuilding building,
                                            std::shared_ptr<const WalkableSurface>& surface);

class FeltOrgan {
 public:
  FeltOrgan(Entity organ, std::unique_ptr<FeltBody> body);
  ~FeltOrgan();  ///< once the servo rests
  FeltOrgan(const FeltOrgan&) = delete;
  FeltOrgan& operator=(const FeltOrgan&) = delete;

  Entity organ() const { return organ_; }

  /// Servo's thread.
  TactileForce respond(const ToolMotion& motion, double dt) noexcept;

  // The frame's thread:
  /// Of the newest body, whose snapshots are to be filled and published.
  HiveTissue& tissue() const { return next_ ? *next_->tissue : *newest_->tissue; }
  /// What the frame finds of the tool in this organ.
  TripleBuffer<AsFrameFound>& frames() { return frame_.frames(); }
  std::optional<TissueUnder> under;  ///< this frame's, where the tool touches
  /// The organ is that body from now on; null: one that hives can't stand on. The frame's force is
  /// felt then.
  void become(std::unique_ptr<FeltBody> next);
  /// Hives stand on the body that the organ is, once it is handed over.
  bool stands() const { return !lost_.load(std::memory_order_relaxed); }
  bool waits() const { return next_ != nullptr; }  ///< for hand_over()
  /// After its first snapshot was published, which found the tool nearest to this place: the servo
  /// goes over to it at its next tick. Builds a hive there. Nothing where nothing is new.
  void hand_over(const SurfacePoint& nearest);
  /// The servo's part of that, of a servo whose ticks run on this thread.
  void take_over() noexcept;
  // Once the servo rests:
  bool on_newest() const { return !next_ && now_.get() == newest_; }
  /// Counters.
  const HiveTissueFigures& figures() const { return now_->tissue->figures(); }

  /// In lockstep, between ticks, with nothing that waits to be taken over.
  struct State {
    HiveTissue::State tissue;
    FrameFeel::State frame;
    Vec3 force = Vec3::Zero();   ///< of the last tick [N]
    Vec3 change = Vec3::Zero();  ///< that another answer has made [N]
    double easing_left = 0.0;    ///< of that [s]
    bool afresh = false;         ///< the next tick's is another's than the last one's
    bool by_frame = false;       ///< the last one's was the frame's
    double by_hives_for = 0.0;   ///< they could have answered since [s]
    static constexpr auto fields() {
      return std::tuple(field("tissue", &State::tissue), field("frame", &State::frame),
                        field("force", &State::force), field("change", &State::change),
                        field("easing_left", &State::easing_left), field("afresh", &State::afresh),
                        field("by_frame", &State::by_frame),
                        field("by_hives_for", &State::by_hives_for));
    }
  };
  State state() const;
  /// Goes over to a body that waits before, which the state is of.
  void restore(State state);
  bool fits(const State& state) const;

 private:
  bool frame_answers(const TactileForce& by_hives, const TactileForce& found, double dt) noexcept;

  Entity organ_;
  std::unique_ptr<FeltBody> next_;    // the frame's, until it is handed over
  const FeltBody* newest_ = nullptr;  // of those that were
  std::atomic<FeltBody*> coming_ = nullptr, gone_ = nullptr;
  std::atomic<bool> lost_ = false;
  // The servo's:
  std::unique_ptr<FeltBody> now_;
  FrameFeel frame_;
  Vec3 force_ = Vec3::Zero(), change_ = Vec3::Zero();
  double easing_left_ = 0.0, by_hives_for_ = 0.0;
  bool afresh_ = false, by_frame_ = false;
};
static_assert(fields_cover<FeltOrgan::State>() && StateOwner<FeltOrgan>);

}  // namespace viscera
