#include "engine/run/run.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>

#include "engine/features/deformation/deformation.h"
#include "engine/features/smoke/smoke.h"
#include "engine/io/interrupt.h"
#include "engine/io/progress_bar.h"
#include "engine/run/move_to_gpu.h"
#include "engine/run/observers/controls_recorder.h"
#include "engine/run/observers/film_maker.h"
#include "engine/run/observers/force_curves.h"
#include "engine/run/observers/frame_pictures.h"
#include "engine/run/observers/lesion_curve.h"
#include "engine/run/observers/pass_series.h"
#include "engine/run/observers/progress_line.h"
#include "engine/run/observers/review_recorder.h"
#include "engine/run/observers/run_hash.h"
#include "engine/run/observers/sight.h"
#include "engine/run/observers/smoke_series.h"
#include "engine/run/observers/trainee.h"
#include "engine/run/observers/vtk_series.h"
#include "engine/run/run_book.h"
#include "engine/run/run_folder.h"
#include "engine/run/run_report.h"
#include "engine/run/watch.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/world.h"
#include "engine/simulator/build.h"
#include "engine/simulator/controls_file.h"
#include "engine/simulator/loop.h"
#include "engine/simulator/state_file.h"
#include "kernels/base/caught.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

/// What pictures need, made only when they are wanted, and before minutes of preparation: what is
/// missing on this machine shows here.
struct Pictures {
  std::unique_ptr<Studio> studio;   ///< null: none are drawn
  std::unique_ptr<FilmMaker> film;  ///< null: no film, as for snapshots
};

Result<Pictures> open_pictures(const RunOptions& options, bool wanted,
                               const std::shared_ptr<EglContext>& context) {
  Pictures pictures;
  if (!wanted) return pictures;
  auto studio = Studio::open(
      {options.width, options.height, options.quality, !options.passes.empty()}, context);
  if (!studio) return std::unexpected(studio.error());
  pictures.studio = *std::move(studio);
  if (!options.snapshots.empty()) return pictures;
  auto film = FilmMaker::start(options.out, options.width, options.height);
  if (!film) return std::unexpected(film.error());
  pictures.film = *std::move(film);
  return pictures;
}

/// Which of a run's pictures are wanted: all, or those nearest to the snapshots' times.
class WantedPictures {
 public:
  WantedPictures(const std::vector<double>& snapshots, std::uint64_t frames, const StepRate& steps)
      : all_(snapshots.empty()) {
    const std::uint64_t count = frames / steps_a_picture(steps);
    if (count == 0) return;
    for (const double time : snapshots) {
      const double nearest = time * static_cast<double>(kPicturesPerSecond) - 1.0;
      some_.insert(static_cast<std::uint64_t>(
          std::clamp(std::round(nearest), 0.0, static_cast<double>(count - 1))));
    }
  }
  bool contains(std::uint64_t number) const { return all_ || some_.contains(number); }
  std::uint64_t before(std::uint64_t number) const {
    if (all_) return number;
    return static_cast<std::uint64_t>(std::distance(some_.begin(), some_.lower_bound(number)));
  }

 private:
  bool all_;
  std::set<std::uint64_t> some_;
};

/// Whoever watches this run. In any order.
Watch watch_of(const World& world, const SceneDescription& scene, const RunOptions& options,
               const Trace& trace, std::uint64_t frames, Pictures& pictures) {
  const bool drawn = pictures.studio != nullptr, filmed = pictures.film != nullptr;
  Watch watch;
  if (!options.quiet) watch.add(std::make_unique<ProgressLine>(frames));
  watch.add(std::make_unique<ForceCurves>(scene));
  watch.add(std::make_unique<ReviewRecorder>(world, scene, trace, filmed ? kFilmName : "", drawn));
  watch.add(std::make_unique<Trainee>(world, scene));
  watch.add(std::make_unique<LesionCurve>(world, scene));
  watch.add(std::make_unique<RunHash>());
  if (!smoke_of(scene).empty()) {
    if (scene.camera) watch.add(std::make_unique<Sight>());
    watch.add(std::make_unique<SmokeSeries>(scene.name));
  }
  if (!options.record_controls.empty())
    watch.add(std::make_unique<ControlsRecorder>(options.record_controls));
  if (options.vtk) watch.add(std::make_unique<VtkSeries>(world));
  if (!options.passes.empty()) watch.add(std::make_unique<PassSeries>(scene, options.passes));
  if (filmed) watch.add(std::move(pictures.film));
  if (drawn) watch.add(std::make_unique<FramePictures>());
  return watch;
}

/// Prepares organs, begins a simulation and moves what can be to the GPU; fills in what the report
/// says of it.
Result<Simulation> prepare(const SceneDescription& scene,
                           const std::map<std::string, Tissue>& tissues, const RunOptions& options,
                           const ComputeDevice& device, RunReport& report) {
  std::optional<ProgressBar> bar;
  if (!options.quiet) bar.emplace("preparing");
  auto model = build_model(scene, tissues, {options.assets, options.use_cache},
                           bar ? bar->progress() : until_interrupted(), report.warnings);
  bar.reset();
  if (!model) return std::unexpected(model.error());
  auto simulation = Simulation::create(Model(*std::move(model)));
  if (!simulation) return simulation;
  if (auto moved = move_world_to_gpu(simulation->world(), device, options.backend, report); !moved)
    return std::unexpected(moved.error());
  if (!options.quiet) std::cerr << backend_line(report) << '\n';
  return simulation;
}

/// What is recorded of a run, as far as it goes on from a checkpoint, and when the next one is due.
class Checkpoints {
 public:
  Checkpoints(const RunOptions& options, const std::filesystem::path& folder, std::string computing)
      : options_(options), file_(folder / kCheckpointName), computing_(std::move(computing)) {}

  /// Takes a run up where its checkpoint left it.
  Result<void> resume(World& world, Watch& watch, RunBook& book, Trace& trace) const {
    const auto checkpoint = read_checkpoint(file_, identity_of(world, computing_));
    if (!checkpoint) return std::unexpected(checkpoint.error());
    const CheckpointPart* state = checkpoint->find(kWorldPart);
    const CheckpointPart* run = checkpoint->find(kRunPart);
    if (!state || !run)
      return failure(file_.string() + ": found a checkpoint without a run, expected a run's");
    if (auto loaded = load_book(*run, options_, flags_of(world.model().features()), book, trace);
        !loaded)
      return loaded;
    if (auto loaded = world.load_state(state->bytes); !loaded) return loaded;
    return watch.load(*checkpoint, {kRunPart, kWorldPart});
  }

  bool due() const {
    return options_.checkpoint_s > 0.0 && since_.seconds() > options_.checkpoint_s;
  }
  bool wanted() const { return options_.checkpoint_s > 0.0; }

  /// What it refers to is on the disk before it is.
  Result<void> write(const World& world, Watch& watch, const RunBook& book, const Trace& trace,
                     const RunFolder& folder) {
    Checkpoint checkpoint{.identity = identity_of(world, computing_), .parts = {}};
    checkpoint.parts.push_back(book_part(book, trace, options_));
    checkpoint.parts.push_back({kWorldPart, world.save_state()});
    if (auto saved = watch.save(checkpoint.parts); !saved) return saved;
    if (auto synced = folder.sync(); !synced) return synced;
    auto written = write_checkpoint(file_, checkpoint);
    since_ = Stopwatch();
    return written;
  }

  /// The run is whole: there is nothing to go on with.
  void forget() const {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }

 private:
  const RunOptions& options_;
  std::filesystem::path file_;
  std::string computing_;
  Stopwatch since_;
};

/// What goes wrong in a run besides its observers, and whether it may go on.
class Course {
 public:
  Course(const World& world, const Watch& watch) : world_(world), watch_(watch) {}

  /// Does a part of the run. What it fails with, or throws, is kept; false then.
  template <class Work>
  bool part(const char* what, const Work& work) {
    const Result<void> done = caught(work);
    if (!done) own_.push_back({what, world_.time(), done.error().text()});
    return done.has_value();
  }
  bool sound() const { return own_.empty() && watch_.failures().empty(); }

  /// Says how the run has ended. What goes wrong afterwards needs another call.
  void tell(std::uint64_t frames, RunReport& report) const {
    report.failures = watch_.failures();
    report.failures.insert(report.failures.end(), own_.begin(), own_.end());
    std::ranges::stable_sort(report.failures, {}, &FailureReport::time_s);
    report.complete = world_.frame() == frames && report.failures.empty();
    report.reason.clear();
    if (report.complete) return;
    const int signal = interrupt_signal();
    if (report.failures.empty() && signal == SIGALRM)
      report.reason = fmt::format("stopped at {:.2f} s, where its time was up", world_.time());
    else if (report.failures.empty())
      report.reason = fmt::format("stopped by a signal ({}) at {:.2f} s",
                                  signal > 0 ? ::strsignal(signal) : "unknown", world_.time());
    else
      report.reason = fmt::format("{} at {:.2f} s: {}", report.failures[0].what,
                                  report.failures[0].time_s, report.failures[0].why);
  }

 private:
  const World& world_;
  const Watch& watch_;
  std::vector<FailureReport> own_;
};

/// As an exception of a step's parallel work.
void throw_in_a_thread() {
  oneapi::tbb::parallel_for(0, 64, [](int i) {
    if (i == 63) throw std::runtime_error("thrown for a test");
  });
}

/// What moves the tools: a recording, or nothing but their paths.
Result<std::function<Result<Controls>(const Simulation&)>> replay_of(const RunOptions& options,
                                                                     const Model& model,
                                                                     std::uint64_t frames) {
  std::function<Result<Controls>(const Simulation&)> none;
  if (options.replay.empty()) return none;
  auto recorded = read_controls(options.replay, model.tools(), model.scene()->steps().per_second);
  if (!recorded) return std::unexpected(recorded.error());
  if (recorded->size() < frames)
    return failure(fmt::format("{}: found {} frames, expected the scene's {}: a shorter --duration",
                               options.replay.string(), recorded->size(), frames));
  return [all = *std::move(recorded)](const Simulation& simulation) -> Result<Controls> {
    return all[simulation.frame()];
  };
}

}  // namespace

Result<RunReport> run_scene(const SceneDescription& scene_in,
                            const std::map<std::string, Tissue>& tissues,
                            const RunOptions& options) {
  const Stopwatch whole;
  SceneDescription scene = scene_in;
  if (!anything_smokes(scene)) scene.extras.remove<SmokeDescriptions>();
  const bool drawn = options.render && scene.camera.has_value();

  std::optional<oneapi::tbb::global_control> threads;
  if (options.threads > 0)
    threads.emplace(oneapi::tbb::global_control::max_allowed_parallelism, options.threads);
  if (!drawn && !options.passes.empty()) {
    return failure(options.render ? "--passes: found a scene without camera, expected one"
                                  : "--passes: found --no-render, expected pictures to be drawn");
  }
  auto folder = RunFolder::take(options.out);
  if (!folder) return std::unexpected(folder.error());
  if (auto room = folder->reserve(); !room) return std::unexpected(room.error());

  RunReport report = begun_report(scene_in, options);
  auto device = open_compute_device(options.backend, drawn);
  if (!device) return std::unexpected(device.error());
  report.backend = name_of(device->decision.backend);
  report.backend_reason = device->decision.reason;
  if (!device->decision.warning.empty()) report.warnings.push_back(device->decision.warning);
  auto pictures = open_pictures(options, drawn, device->context);
  if (!pictures) return std::unexpected(pictures.error());
  Studio* const studio = pictures->studio.get();
  if (studio) report.renderer = studio->device();

  auto simulation = prepare(scene, tissues, options, *device, report);
  if (!simulation) return std::unexpected(simulation.error());
  World& world = simulation->world();
  if (options.checkpoint_s > 0.0 || options.resume)
    if (auto savable = check_savable(world); !savable) return std::unexpected(savable.error());
  report.prepare_s = whole.seconds();

  Trace trace(stage_names());
  const std::uint64_t frames = scene.steps.steps_in(scene.duration);
  trace.reserve(frames * stage_names().size());
  auto replayed = replay_of(options, Model(world.shared_model()), frames);
  if (!replayed) return std::unexpected(replayed.error());
  RunBook book;
  Watch watch = watch_of(world, scene, options, trace, frames, *pictures);
  Checkpoints checkpoints(options, folder->path(), report.backend);
  if (options.resume)
    folder->keep();
  else
    folder->clear();
  if (auto opened = watch.open(folder->path()); !opened) return std::unexpected(opened.error());
  if (auto begun = options.resume ? checkpoints.resume(world, watch, book, trace) : watch.begin();
      !begun)
    return std::unexpected(begun.error());

  StageClock clock;
  FrameViews::Makers makers{.scene = scene, .studio = studio, .clock = clock};
  if (scene.camera) makers.endoscope.emplace(*scene.camera);
  // A device that is lost has nothing of the organs any more.
  if (studio) studio->on_loss([&world] { leave_gpu(world, "its context was lost"); });
  const std::shared_ptr<EglContext> context = studio ? studio->context() : device->context;
  const WantedPictures wanted(options.snapshots, frames, scene.steps);
  const double before_s = book.wall_s;
  const Stopwatch watched;
  Course course(world, watch);
  const auto write_checkpoint = [&] {
    book.wall_s = before_s + watched.seconds();
    return checkpoints.write(world, watch, book, trace, *folder);
  };
  Loop loop{.until = frames};
  loop.controls = *std::move(replayed);
  loop.pace = [&](Simulation& one) {
    if (one.frame() + 1 == options.lose_context_at && context) context->declare_lost();
    if (one.frame() + 1 == options.throw_at) throw_in_a_thread();
    return course.sound() && !interrupted();
  };
  loop.look = [&](Simulation& one, const StepReport& step) -> Result<void> {
    book.flags.raise(step.flags);
    book.strays.add(step.strays, one.time());
    {
      const StageTimer timer(trace, stage_index(RunStage::kRecord), one.frame());
      watch.add_frame(world);
    }
    if (const std::uint64_t apart = steps_a_picture(scene.steps); one.frame() % apart == 0) {
      const std::uint64_t number = one.frame() / apart - 1;
      FrameViews views(world, makers, number, wanted.before(number));
      watch.add_picture(views, clock, wanted.contains(number));
      clock.tell(trace, one.frame());
    }
    if (course.sound() && checkpoints.due()) course.part("checkpoint", write_checkpoint);
    return {};
  };
  simulation->trace(&trace);
  const bool stepped = course.part("simulation", [&] { return step_through(*simulation, loop); });
  // Stopped from outside: what is done can be gone on with. After a failure the last one stands.
  if (course.sound() && world.frame() < frames && checkpoints.wanted())
    course.part("checkpoint", write_checkpoint);
  book.wall_s = before_s + watched.seconds();

  folder->release(RunFolder::Room::kFiles);
  watch.close(world);
  report.wall_s = book.wall_s;
  if (studio)
    report.warnings.insert(report.warnings.end(), studio->warnings().begin(),
                           studio->warnings().end());
  course.part("report", [&] { finish_report(world, scene, trace, book, report); });
  watch.describe(world, report);
  if (!stepped) report.state_hash.clear();  // a step that was left in the middle is no state
  course.part("profile", [&] { return trace.write(options.out / "profile.json", "viscera"); });
  course.tell(frames, report);
  watch.present(report);
  course.part("disk", [&] { return folder->sync(); });
  folder->release(RunFolder::Room::kReport);
  course.tell(frames, report);
  if (!course.part("report", [&] { return write_report(options.out / "report.json", report); }))
    course.tell(frames, report);
  if (report.complete) checkpoints.forget();
  return report;
}

}  // namespace viscera
