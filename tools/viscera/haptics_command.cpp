#include "tools/viscera/haptics_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <ostream>
#include <thread>

#include "engine/features/held_tools/haptic_recording.h"
#include "engine/features/held_tools/held_tools.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/progress_bar.h"
#include "engine/io/report.h"
#include "engine/render/renderer.h"
#include "engine/run/view.h"
#include "engine/simulation/frame.h"
#include "engine/simulator/build.h"
#include "engine/simulator/loop.h"
#include "kernels/base/stopwatch.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"
#include "tools/viscera/haptics_report.h"

namespace viscera {
namespace {

constexpr double kMostSeconds = 86400.0;
/// Pictures beside take at most this share of the frame thread's time, so that the scene goes on.
constexpr double kPictureShare = 0.5;

/// The command line's device in place of every haptic tool's.
Result<void> take_device(SceneDescription& scene, const HapticsOptions& options) {
  using Device = HapticDescription::Device;
  Error mistakes;
  if (!(options.seconds > 0.0 && options.seconds <= kMostSeconds))
    mistakes.messages.push_back(
        fmt::format("--seconds: found {:g}, expected more than 0 and at most {:g}", options.seconds,
                    kMostSeconds));
  std::size_t held = 0;
  for (InstrumentDescription& tool : scene.instruments) {
    auto* haptic = tool.extras.find<HapticDescription>();
    if (!haptic) continue;
    ++held;
    if (options.device == "simulated") haptic->device = Device::kSimulated;
    if (options.device == "recorded") haptic->device = Device::kRecorded;
    if (options.device == "network") haptic->device = Device::kNetwork;
    if (!options.recording.empty()) haptic->recording = options.recording;
    // Each tool behind a port of its own.
    if (options.port > 0) haptic->port = options.port + static_cast<int>(held) - 1;
  }
  if (held == 0)
    mistakes.messages.push_back(
        fmt::format("{}: instruments: found none with the key haptic, expected one that is held",
                    scene.file.string()));
  if (options.device == "recorded" && options.recording.empty())
    mistakes.messages.push_back("--device recorded: found no --recording, expected its file");
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

/// Draws when there is time for it.
class SideRenderer {
 public:
  static Result<SideRenderer> open(const SceneDescription& scene, bool wanted) {
    SideRenderer side(scene);
    if (!wanted || !scene.camera) return side;
    RenderOptions options;
    options.quality = Quality::kDraft;
    auto renderer = Renderer::create(options);
    if (!renderer) return std::unexpected(renderer.error());
    side.renderer_ = std::move(*renderer);
    side.endoscope_.emplace(*scene.camera);
    return side;
  }

  Result<void> draw(const World& world, double now) {
    if (!renderer_ || now < next_) return {};
    const Stopwatch watch;
    splat_smoke(world, shown_.smoke);
    const FrameView view = make_view(world, shown_, *scene_, *endoscope_, pictures_);
    if (auto drawn = renderer_->draw(view, picture_, nullptr); !drawn) return drawn;
    ++pictures_;
    next_ = now + watch.seconds() / kPictureShare;
    return {};
  }
  std::uint64_t pictures() const { return pictures_; }
  std::string device() const { return renderer_ ? renderer_->device() : ""; }

 private:
  explicit SideRenderer(const SceneDescription& scene) : scene_(&scene) {}

  const SceneDescription* scene_;
  std::unique_ptr<Renderer> renderer_;
  std::optional<Endoscope> endoscope_;
  Shown shown_;
  Picture picture_;
  std::uint64_t pictures_ = 0;
  double next_ = 0.0;
};

/// One file a tool: of several, FILE's name with the tool's in it.
Result<void> write_recordings(const std::vector<HapticTool>& tools,
                              const std::filesystem::path& file, std::ostream& out) {
  for (const HapticTool& tool : tools) {
    if (!tool.recorder) continue;
    std::filesystem::path own = file;
    if (tools.size() > 1)
      own.replace_filename(
          fmt::format("{}_{}{}", file.stem().string(), tool.name, file.extension().string()));
    if (auto written = save_recording(own, tool.recorder->recording()); !written) return written;
    if (tool.recorder->dropped() > 0)
      out << fmt::format("warning: {}: {} ticks didn't fit any more\n", own.string(),
                         tool.recorder->dropped());
  }
  return {};
}

}  // namespace

Result<void> run_haptics(SceneDescription scene, const std::map<std::string, Tissue>& tissues,
                         const HapticsOptions& options, std::ostream& out) {
  if (auto sound = take_device(scene, options); !sound) return sound;
  if (auto writable = check_outputs({options.json, options.record}, options.plots); !writable)
    return writable;
  std::vector<std::string> warnings;
  std::optional<ProgressBar> bar;
  bar.emplace("preparing");
  auto model = build_model(scene, tissues, {assets_folder(), true}, bar->progress(), warnings);
  bar.reset();
  if (!model) return std::unexpected(model.error());
  auto simulation = Simulation::create(Model(*std::move(model)), {.hands = Hands::kNone});
  if (!simulation) return std::unexpected(simulation.error());
  for (const std::string& warning : warnings) out << "warning: " << warning << '\n';
  const ServoRun run{ServoClock::kRealTime, options.seconds, !options.record.empty()};
  if (auto held = hold_tools(simulation->world(), run); !held) return held;
  HapticTools& servos = *servos_of(simulation->world());
  auto pictures = SideRenderer::open(scene, options.render);
  if (!pictures) return std::unexpected(pictures.error());

  HapticsReport report;
  bar.emplace("in touch");
  const Progress progress = bar->progress();
  const Stopwatch watch;
  const double step = scene.steps.step();
  double due = 0.0;
  Loop loop{.until = std::numeric_limits<std::uint64_t>::max()};
  loop.pace = [&](Simulation&) {
    const double now = watch.seconds();
    if (now >= options.seconds || !progress(now / options.seconds, "held")) return false;
    if (now < due) std::this_thread::sleep_for(std::chrono::duration<double>(due - now));
    // A scene that is late goes on from here: it isn't hurried to make up for it.
    if (now > due + step) {
      ++report.late_frames;
      due = now;
    }
    due += step;
    return true;
  };
  loop.look = [&](Simulation& one, const StepReport&) {
    ++report.frames;
    return pictures->draw(one.world(), watch.seconds());
  };
  if (auto stepped = step_through(*simulation, loop); !stepped) return stepped;
  bar.reset();
  servos.stop();
  servos.collect_events();

  report.scene = scene.name;
  report.machine = this_machine().cpu;
  report.cores = this_machine().cores;
  report.seconds = watch.seconds();
  report.simulated = simulation->time();
  report.pictures = pictures->pictures();
  report.renderer = pictures->device();
  for (HapticTool& tool : servos.tools()) report.tools.push_back(report_of(tool));
  print(report, out);
  if (!options.plots.empty())
    if (auto drawn = draw_latency_plots(servos.tools(), options.plots); !drawn) return drawn;
  if (auto written = write_recordings(servos.tools(), options.record, out); !written)
    return written;
  if (options.json.empty()) return {};
  return write_file(options.json, to_json_text(report));
}

}  // namespace viscera
