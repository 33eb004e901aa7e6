// Tools that are held: a device moves the tip and feels its force, 1,000 times a second (haptics/).
//
// The frame tells the servo side where tissue is (TissueSnapshot) and takes from it where the tools
// are; neither waits for the other. In lockstep the ticks of a frame run on the frame's own thread
// before it, on the logical clock; in real time each device has a thread on the wall clock.
#pragma once

#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/features/contact/frame_feel.h"
#include "engine/features/held_tools/felt_organ.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/parting/blade_feel.h"
#include "engine/simulation/feature.h"
#include "haptics/device.h"
#include "haptics/devices/recording.h"
#include "haptics/servo_loop.h"
#include "haptics/servo_tick.h"

namespace viscera {

enum class ServoClock { kLockstep, kRealTime };

struct ServoRun {
  ServoClock clock = ServoClock::kLockstep;
  double seconds = 0.0;  ///< that a modelled hand goes on, its path again and again; 0: once
  bool record = false;   ///< keep what devices read and were given
};

/// All tissue that one tool may feel: the sum of its organs. Servo thread, but for the snapshots.
class ToolTissue final : public TactileModel {
 public:
  std::deque<FeltOrgan> organs;
  FrameFeel shaft;  ///< what organs do to its shaft; nothing, where shafts don't touch
  BladeFeel blade;  ///< what holds its edge; nothing of what is no scalpel

  TactileForce respond(const ToolMotion& motion, double dt) noexcept override;
  /// Of all organs together; once the servo rests.
  HiveTissueFigures figures() const;
};

/// How far what the hand felt lies from what the frame's own contact finds for the same tool, over
/// the frames in which it touched and stood still.
struct Agreement {
  double felt = 0.0, difference = 0.0;  ///< sums of squares [N2]
  std::uint64_t frames = 0;
  Vec3 tip = Vec3::Zero();  ///< a frame ago [m]

  /// Of what was felt, in the root of the mean square; 0: it never stood still.
  double ratio() const { return felt > 0.0 ? std::sqrt(difference / felt) : 0.0; }
  static constexpr auto fields() {
    return std::tuple(field("felt", &Agreement::felt), field("difference", &Agreement::difference),
                      field("frames", &Agreement::frames), field("tip", &Agreement::tip));
  }
};
static_assert(fields_cover<Agreement>());

/// One held instrument.
struct HapticTool {
  Entity instrument;
  std::string name;
  std::unique_ptr<HapticDevice> device;
  std::unique_ptr<RecordingDevice> recorder;  ///< between servo and device; null: nothing is kept
  std::unique_ptr<ToolTissue> tissue;
  std::unique_ptr<ServoTick> servo;
  std::unique_ptr<LockstepServo> lockstep;  ///< on the logical clock
  std::unique_ptr<ServoLoop> loop;          ///< on the wall clock
  ServoOutput output;                       ///< of the last tick that the frame has seen
  std::vector<std::string> events;          ///< what happened, in sentences
  bool met = false;  ///< the device has been engaged: `output` says where it is
  Agreement agreement;

  /// What the servo reads and writes.
  HapticDevice& felt() const { return recorder ? static_cast<HapticDevice&>(*recorder) : *device; }
};

class HapticTools {
 public:
  /// Every instrument with `haptic` gets its device, its tissue and its servo. Null where the scene
  /// has none. Fails, naming the instrument, where a tip isn't a ball, a path leaves the device's
  /// work space, a recording can't be read or a port is taken.
  static Result<std::unique_ptr<HapticTools>> create(const SceneDescription& scene,
                                                     const World& world, const ServoRun& run);
  ~HapticTools();  ///< stops

  /// An organ is another body, which hands go over to once it is published or a state is restored.
  void replace_body(const World& world, Entity organ);
  /// Begins to find what the tissue under tools answers.
  void ask_tissue(World& world, Aside& aside);
  /// What the servos see of the scene as it is at the end of this frame: each organ as their tool
  /// meets it, with all that others do to it (engine/features/contact/tissue_as_met.h). After
  /// what ask_tissue() began.
  void publish(World& world, std::uint64_t frame);
  /// Ticks up to and without `end` in lockstep; in real time it is the clock that ticks, and the
  /// first call starts it.
  void advance_to(std::uint64_t end);
  /// What the servos and the devices have to tell since the last call -> HapticTool::events. Once a
  /// frame, and after stop().
  void collect_events();
  /// Lets go of all devices and ends their threads.
  void stop();
  /// Where the tools are now -> InstrumentState.
  void place_tools(World& world);
  /// What the hands feel -> InstrumentContact and CellRange, in place of what contact found.
  void take_felt_forces(World& world, double dt);

  /// All of it in lockstep, between ticks, of devices that can be saved; none of it in real time,
  /// where the servos' threads write it.
  struct State {
    struct Tool {
      ServoTick::State servo;
      LockstepServo::State lockstep;
      ServoOutput output;
      std::vector<FeltOrgan::State> tissue;  ///< of its organs
      FrameFeel::State shaft;
      BladeFeel::State blade;
      std::vector<std::byte> device;
      std::vector<std::string> events;
      bool met = false;
      Agreement agreement;
      static constexpr auto fields() {
        return std::tuple(field("servo", &Tool::servo), field("lockstep", &Tool::lockstep),
                          field("output", &Tool::output), field("tissue", &Tool::tissue),
                          field("shaft", &Tool::shaft), field("blade", &Tool::blade),
                          field("device", &Tool::device), field("events", &Tool::events),
                          field("met", &Tool::met), field("agreement", &Tool::agreement));
      }
    };
    std::vector<Tool> tools;
    static constexpr auto fields() { return std::tuple(field("tools", &State::tools)); }
  };
  State state() const;
  void restore(State state);
  bool fits(const State& state) const;
  /// Why it can't be; empty: it can.
  std::string why_not_saved() const;

  ServoClock clock() const { return clock_; }
  std::vector<HapticTool>& tools() { return tools_; }
  const std::vector<HapticTool>& tools() const { return tools_; }

 private:
  explicit HapticTools(ServoClock clock) : clock_(clock) {}

  ServoClock clock_;
  bool started_ = false;
  std::vector<HapticTool> tools_;
};

/// A world's held tools; none: none is held, paths move them.
struct Servos {
  static constexpr std::string_view kName = "servos";
  std::unique_ptr<HapticTools> tools;
  static constexpr auto fields() { return std::tuple(field("tools", &Servos::tools)); }
};
static_assert(fields_cover<Servos>());

/// Puts the scene's held tools into hands: devices, servos. Nothing where the scene has none.
Result<void> hold_tools(World& world, const ServoRun& run);
HapticTools* servos_of(World& world);  ///< null: none
const HapticTools* servos_of(const World& world);

/// An instrument that was held, and what its device felt.
struct HapticFigures {
  std::string tool, device;
  std::uint64_t ticks = 0;
  double greatest_force = 0.0;  ///< on the hand [N]
  double energy = 0.0;          ///< net to the hand [J]
  std::uint64_t passivity_violations = 0;
  HiveTissueFigures tissue;
  double frame_difference = 0.0;  ///< of what was felt (Agreement)
  std::uint64_t frames_at_rest = 0;
  std::vector<std::string> events;
};
/// Between ticks.
std::vector<HapticFigures> haptic_figures(const World& world);
std::vector<ReportSection> held_tools_report(const World& world);  ///< "haptics"
std::vector<SkippedReport> held_tools_skipped(const SceneDescription& scene);

Feature held_tools_feature();

}  // namespace viscera
