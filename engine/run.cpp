#include "engine/run.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <thread>

#include "engine/frame.h"
#include "engine/gpu/gpu_smoke.h"
#include "engine/io/atomic_file.h"
#include "engine/io/film.h"
#include "engine/io/forces_csv.h"
#include "engine/io/interrupt.h"
#include "engine/io/png_file.h"
#include "engine/io/progress_bar.h"
#include "engine/io/review.h"
#include "engine/io/smoke_file.h"
#include "engine/lesion_curve.h"
#include "engine/render/renderer.h"
#include "engine/review_recorder.h"
#include "engine/state_hash.h"
#include "engine/systems/gpu_surfaces.h"
#include "engine/systems/haptic_tools.h"
#include "engine/systems/heat_setup.h"
#include "engine/systems/systems.h"
#include "engine/systems/view.h"
#include "engine/trainee.h"
#include "engine/vtk_series.h"
#include "engine/world.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// Marks a folder as a run's, whose files a later run may replace.
constexpr const char* kMarker = ".viscera-run";

/// Numbered files of an older run in a folder and the folders right under it.
std::vector<fs::path> numbered_files(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error), end;
  for (; !error && entry != end; entry.increment(error)) {
    if (entry.depth() >= 1) entry.disable_recursion_pending();
    const std::string stem = entry->path().stem().string();
    if (entry->path().extension() == extension &&
        stem.find_first_not_of("0123456789") == std::string::npos)
      files.push_back(entry->path());
  }
  return files;
}

/// What a run writes and a later run into the same folder replaces, so that no frame of one mixes
/// with the other's.
std::vector<fs::path> older_files(const fs::path& out) {
  std::vector<fs::path> files = numbered_files(out / "frames", ".png");
  const std::vector<fs::path> volumes = numbered_files(out / "smoke", ".vdb");
  files.insert(files.end(), volumes.begin(), volumes.end());
  const std::vector<fs::path> surfaces = numbered_files(out / "vtk", ".vtu");
  files.insert(files.end(), surfaces.begin(), surfaces.end());
  const std::vector<fs::path> passes = numbered_files(out / "passes", ".exr");
  files.insert(files.end(), passes.begin(), passes.end());
  for (const char* name : {"vtk/organs.pvd", "film.mp4", "forces.csv", "lesion.csv", "lesion.svg",
                           "profile.json", "report.json", "review.html"}) {
    std::error_code error;
    if (fs::is_regular_file(out / name, error)) files.push_back(out / name);
  }
  return files;
}

/// Refuses a folder with files of these names that no run of ours has written.
Result<void> check_out(const fs::path& out) {
  if (auto writable = check_out_folder(out); !writable) return writable;
  std::error_code error;
  if (fs::exists(out / kMarker, error)) return {};
  const std::vector<fs::path> others = older_files(out);
  if (others.empty()) return {};
  return failure(
      fmt::format("--out {}: found {}, which no run of this program has written, expected "
                  "an empty folder or one of an older run",
                  out.string(), others.front().string()));
}

/// Makes room for a run in a folder that may hold an older one, whose files go all together.
Result<void> open_folder(const fs::path& out, bool pictures, bool smoke, bool surfaces,
                         bool passes) {
  if (auto marked = write_file(out / kMarker, "", Durable::kNo); !marked) return marked;
  std::error_code ignored;
  for (const fs::path& file : older_files(out)) fs::remove(file, ignored);
  if (pictures)
    if (auto made = check_out_folder(out / "frames"); !made) return made;
  if (smoke)
    if (auto made = check_out_folder(out / "smoke"); !made) return made;
  if (surfaces)
    if (auto made = check_out_folder(out / "vtk"); !made) return made;
  if (passes)
    if (auto made = check_out_folder(out / "passes"); !made) return made;
  return {};
}

/// Everything a picture needs, made only when pictures are wanted.
struct Studio {
  std::shared_ptr<EglContext> context;
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<Film> film;  ///< none for snapshots
  Endoscope endoscope;
  Picture picture;
  std::unique_ptr<PassWriter> passes;  ///< where ground truth is wanted
  std::uint64_t pictures = 0;
};

Result<std::unique_ptr<Renderer>> open_renderer(const RunOptions& options,
                                                std::shared_ptr<EglContext> context) {
  RenderOptions render;
  render.width = options.width;
  render.height = options.height;
  render.quality = options.quality;
  render.context = std::move(context);
  return Renderer::create(render);
}

/// `context`: null, it makes its own.
Result<std::unique_ptr<Studio>> open_studio(const SceneDescription& scene,
                                            const RunOptions& options,
                                            std::shared_ptr<EglContext> context) {
  if (!context) {
    auto made = EglContext::create();
    if (!made) return std::unexpected(made.error());
    context = *std::move(made);
  }
  auto renderer = open_renderer(options, context);
  if (!renderer) return std::unexpected(renderer.error());
  auto studio = std::make_unique<Studio>(
      Studio{context, std::move(*renderer), nullptr, Endoscope(*scene.camera), {}, nullptr, 0});
  if (!options.passes.empty()) studio->passes = std::make_unique<PassWriter>(options.passes);
  if (!options.snapshots.empty()) return studio;
  auto film = Film::start(options.out / "film.mp4", options.width, options.height);
  if (!film) return std::unexpected(film.error());
  studio->film = std::move(*film);
  return studio;
}

/// After a loss of the context: another one for the pictures, and the CPU for the rest.
Result<void> reopen_renderer(Studio& studio, World& world, const RunOptions& options,
                             std::vector<std::string>& warnings) {
  leave_gpu(world, "its context was lost");
  const std::string lost = studio.renderer->device();
  studio.renderer
      .reset();  // before another context is there to take its objects' names for its own
  auto context = EglContext::create();
  if (!context)
    return failure(
        fmt::format("{}: its OpenGL context was lost at {:.2f} s, and pictures need "
                    "another: {}",
                    lost, world.time(), context.error().text()));
  studio.context = *std::move(context);
  auto renderer = open_renderer(options, studio.context);
  if (!renderer) return std::unexpected(renderer.error());
  studio.renderer = *std::move(renderer);
  warnings.push_back(fmt::format(
      "{}: its OpenGL context was lost at {:.2f} s; pictures went on with another one on {}", lost,
      world.time(), studio.renderer->device()));
  return {};
}

Result<void> draw(Studio& studio, World& world, const SceneDescription& scene,
                  const RunOptions& options, PassImages* passes,
                  std::vector<std::string>& warnings) {
  const auto picture = [&] {
    return studio.renderer->draw(make_view(world, scene, studio.endoscope, studio.pictures),
                                 studio.picture, passes);
  };
  Result<void> drawn = picture();
  if (drawn || !studio.context->lost()) return drawn;
  if (auto reopened = reopen_renderer(studio, world, options, warnings); !reopened) return reopened;
  return picture();
}

Result<void> take_picture(Studio& studio, World& world, const SceneDescription& scene,
                          const RunOptions& options, Trace& trace, ReviewRecorder& recorder,
                          std::vector<std::string>& warnings) {
  const fs::path& out = options.out;
  PassImages truth;
  {
    const StageTimer timer(trace, stage_index(Stage::kDraw), world.frame);
    PassImages* wanted = studio.passes ? &truth : nullptr;
    if (auto drawn = draw(studio, world, scene, options, wanted, warnings); !drawn) return drawn;
  }
  const StageTimer timer(trace, stage_index(Stage::kEncode), world.frame);
  const std::uint64_t number = world.frame / kFramesPerPicture - 1;
  if (studio.passes) {
    if (auto sound = studio.passes->status(); !sound) return sound;
    const FrameView view = make_view(world, scene, studio.endoscope, studio.pictures);
    studio.passes->write(out / "passes" / fmt::format("{:04}.exr", number), std::move(truth),
                         pass_context(view, scene.name, world.time(), !scene.smoke.empty()));
  }
  const Picture& p = studio.picture;
  recorder.add_picture(world, p);
  if (studio.film)
    if (auto added = studio.film->add(p.rgb); !added) return added;
  const fs::path file = out / "frames" / fmt::format("{:04}.png", number);
  ++studio.pictures;
  return write_png(file, p.width, p.height, p.rgb);
}

/// Numbers of the pictures nearest to the snapshots' times; empty: every picture.
std::set<std::uint64_t> wanted_pictures(const std::vector<double>& snapshots,
                                        std::uint64_t frames) {
  std::set<std::uint64_t> pictures;
  const std::uint64_t count = frames / kFramesPerPicture;
  if (count == 0) return pictures;
  for (const double time : snapshots) {
    const double nearest = time * static_cast<double>(kFramesPerSecond) / kFramesPerPicture - 1.0;
    pictures.insert(static_cast<std::uint64_t>(
        std::clamp(std::round(nearest), 0.0, static_cast<double>(count - 1))));
  }
  return pictures;
}

/// How long smoke hides the tips.
class Sight {
 public:
  explicit Sight(const SceneDescription& scene) {
    if (scene.camera) endoscope_.emplace(*scene.camera);
  }
  void look(const World& world) {
    if (!endoscope_) return;
    const std::optional<double> seen = sight_of_tips(world, endoscope_->at(world.time()));
    if (!seen) return;
    ++looks_;
    if (*seen < kHidden) ++hidden_;
  }
  /// Share of the looks at which less than half of the light came through.
  std::optional<double> time_in_smoke() const {
    if (looks_ == 0) return {};
    return static_cast<double>(hidden_) / static_cast<double>(looks_);
  }

 private:
  static constexpr double kHidden = 0.5;
  std::optional<Endoscope> endoscope_;
  std::size_t looks_ = 0, hidden_ = 0;
};

void write_volumes(SmokeWriter& writer, const World& world, const SceneDescription& scene,
                   const fs::path& out, std::uint64_t picture) {
  for (const SmokeBody& smoke : world.smoke) {
    if (smoke.volume.particles().size() == 0) continue;
    const std::string name = fmt::format("{:04}.vdb", picture);
    const fs::path folder =
        world.smoke.size() == 1 ? out / "smoke" : out / "smoke" / smoke.description.name;
    std::error_code error;
    fs::create_directories(folder, error);
    writer.write(folder / name, smoke.grid, world.time(), smoke.description.name, scene.name);
  }
}

std::string flag_text(FrameFlag flag) {
  switch (flag) {
    case FrameFlag::kOrganFrozen:
      return "an organ's displacement was not finite; it is frozen: prepare it afresh (--no-cache)";
    case FrameFlag::kContactNotConverged:
      return "contact had no solution in some frame, without force there: smaller tool steps, or "
             "fewer tools on one spot";
    case FrameFlag::kOutOfReach:
      return "a tip touched tissue that its path had not announced, without response";
    case FrameFlag::kGripSlipped:
      return "a closed jaw slid over the tissue: the pull passed its grip limit";
    case FrameFlag::kSmokeFull:
      return "a smoke volume was full; its oldest particles ended: raise max_particles";
    case FrameFlag::kSmokeOutside:
      return "tissue burnt outside every smoke volume; that smoke was not followed: enlarge a "
             "domain";
    case FrameFlag::kHeatFull:
      return "heat found no room for more of an organ's voxels; tissue beyond them counted as "
             "cold: "
             "a greater heat/voxel_mm";
    case FrameFlag::kNotHeated:
      return "a hook gave current to an organ that isn't heated: its tissue lacks thermal values, "
             "or "
             "its path had not announced that it comes there";
    case FrameFlag::kGripMissed:
      return "a jaw closed on nothing: move its closing key nearer to the tissue";
  }
  return {};
}

HapticReport haptic_report(const HapticTool& tool) {
  const HiveTissueFigures figures = tool.tissue->figures();
  HapticReport report;
  report.tool = tool.name;
  report.device = tool.device->name();
  report.ticks = tool.lockstep->next();
  report.greatest_force = tool.servo->greatest_force();
  report.energy = tool.servo->energy_given();
  report.passivity_violations = tool.servo->passivity_violations();
  report.hives_built = figures.hives;
  report.hives_refused = figures.refused;
  report.ticks_without = figures.uncovered;
  report.newton_steps = figures.newton_steps;
  report.tangent_answers = figures.tangent_answers;
  report.deadline_misses = figures.deadline_misses;
  report.linear_answers = figures.linear_answers;
  report.events = tool.events;
  return report;
}

void describe_world(const World& world, const SceneDescription& scene, RunReport& report) {
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    const OrganBody& organ = world.organ_bodies[o];
    const OrganModel& model = *organ.model;
    OrganReport one;
    one.name = organ.name;
    one.nodes = model.cloud.size();
    one.surface_nodes = model.cloud.surface_count;
    one.triangles = model.surface.triangles.size();
    one.prepare_s = model.prepare_s;
    one.cache_hit = model.cache_hit;
    one.memory_bytes = model.memory_bytes();
    if (model.deformable()) one.preparation = model.figures;
    one.half_precision = model.in_half_precision();
    one.storage_error = model.half_columns.error;
    one.saved_bytes = model.saved_bytes();
    report.organs.push_back(std::move(one));
    if (!model.deformable()) report.skipped.push_back(skipped_elasticity(scene.organs[o]));
  }
  for (const Link& link : world.links) {
    const auto described =
        std::find_if(scene.links.begin(), scene.links.end(),
                     [&](const LinkDescription& one) { return one.name == link.name; });
    report.links.push_back({link.name, described->between, described->stiffness,
                            link.springs.size(), link.greatest_force});
  }
  if (world.haptics)
    for (const HapticTool& tool : world.haptics->tools())
      report.haptics.push_back(haptic_report(tool));
  for (const SmokeBody& smoke : world.smoke) {
    const SmokeBook& book = smoke.volume.book();
    report.smoke.particles_max = std::max(report.smoke.particles_max, smoke.most_particles);
    report.smoke.emitted_kg += book.emitted;
    report.smoke.airborne_kg += smoke.volume.airborne();
    report.smoke.background_kg += book.background;
    report.smoke.evacuated_kg += book.evacuated;
    report.smoke.leaked_kg += book.leaked;
    report.smoke.deposited_kg += book.deposited;
  }
}

/// True when some hook carries current at some time.
bool burns(const SceneDescription& scene) {
  return std::any_of(scene.instruments.begin(), scene.instruments.end(), carries_current);
}

/// True when something gives smoke to one of the scene's volumes.
bool smokes(const SceneDescription& scene) {
  if (scene.smoke.empty()) return false;
  return burns(scene) ||
         std::any_of(scene.smoke.begin(), scene.smoke.end(), [](const SmokeDescription& smoke) {
           return std::any_of(
               smoke.emitters.begin(), smoke.emitters.end(),
               [](const EmitterDescription& emitter) { return emitter.instrument.empty(); });
         });
}

}  // namespace

SkippedReport skipped_elasticity(const OrganDescription& organ) {
  return {"elasticity of " + organ.name, organ.deformable
                                             ? "no instrument, link or change of gravity reaches it"
                                             : "scenery: deformable is false"};
}

std::vector<SkippedReport> skipped_parts(const SceneDescription& scene, bool render) {
  std::vector<SkippedReport> skipped;
  if (!render)
    skipped.push_back({"rendering", "--no-render: no pictures, no film"});
  else if (!scene.camera)
    skipped.push_back({"rendering", "the scene has no camera"});
  if (!burns(scene)) skipped.push_back({"heat", "no hook carries current"});
  if (scene.smoke.empty())
    skipped.push_back({"smoke", "the scene has no smoke volume"});
  else if (!smokes(scene))
    skipped.push_back({"smoke", "nothing burns: no hook carries current"});
  if (std::none_of(scene.instruments.begin(), scene.instruments.end(),
                   [](const InstrumentDescription& one) { return one.haptic.has_value(); }))
    skipped.push_back({"haptics", "no instrument is a haptic tool"});
  return skipped;
}

namespace {

/// What is known of a run before anything is prepared.
RunReport begun_report(const SceneDescription& scene, const RunOptions& options) {
  const int available = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  RunReport report;
  report.version = VISCERA_VERSION;
  report.command = options.command;
  report.scene = scene.file.string();
  report.title = scene.title;
  report.seed = scene.seed;
  report.threads = options.threads > 0 ? options.threads : available;
  report.machine = this_machine();
  report.skipped = skipped_parts(scene, options.render);
  return report;
}

/// Organs go to the GPU where the run computes there. Where that fails, only a run that asked for
/// it does too.
Result<void> move_organs_to_gpu(World& world, const ComputeDevice& device, Backend asked,
                                RunReport& report) {
  if (device.decision.backend != Backend::kGpu) return {};
  const Stopwatch watch;
  auto surfaces = GpuSurfaces::create(device.context, world);
  if (!surfaces) {
    if (asked == Backend::kGpu) return std::unexpected(surfaces.error());
    report.backend = name_of(Backend::kCpu);
    report.backend_reason = "auto: " + device.context->device() + " refused the organs";
    report.warnings.push_back(surfaces.error().text());
    return {};
  }
  world.gpu = *std::move(surfaces);
  if (!world.gpu) {
    report.skipped.push_back({"deformation on the GPU", "no organ can be touched"});
    return {};
  }
  const std::vector<std::string>& refusals = world.gpu->refusals();
  report.warnings.insert(report.warnings.end(), refusals.begin(), refusals.end());
  report.gpu = GpuReport{.device = device.context->device(),
                         .start_s = device.start_s + watch.seconds(),
                         .organs = world.gpu->organs(),
                         .bytes = world.gpu->bytes(),
                         .passes = {}};
  return {};
}

/// And a part of what happens in it, likewise: `move` takes it there and says of how many things,
/// which is `count` of the report.
Result<void> move_part_to_gpu(const char* part, const ComputeDevice& device, Backend asked,
                              RunReport& report, std::size_t GpuReport::*count,
                              const std::function<Result<std::size_t>()>& move) {
  if (report.backend != name_of(Backend::kGpu)) return {};
  const Stopwatch watch;
  device.context->make_current();
  const Result<std::size_t> moved = move();
  if (!moved) {
    if (asked == Backend::kGpu) return std::unexpected(moved.error());
    report.warnings.push_back(fmt::format("{}: {} stays on the CPU", moved.error().text(), part));
    return {};
  }
  if (*moved == 0) return {};
  if (!report.gpu)
    report.gpu =
        GpuReport{.device = device.context->device(), .start_s = device.start_s, .passes = {}};
  report.gpu->start_s += watch.seconds();
  (*report.gpu).*count = *moved;
  return {};
}

Result<std::size_t> move_smoke(World& world, const std::shared_ptr<EglContext>& context) {
  if (world.smoke.size() == 0) return 0;
  auto made = GpuSmoke::create(GpuLimits::of_device(), context);
  if (!made) return std::unexpected(made.error());
  const std::shared_ptr<SmokePasses> passes = *std::move(made);
  for (SmokeBody& smoke : world.smoke) smoke.volume.compute_on(passes);
  return world.smoke.size();
}

Result<void> move_world_to_gpu(World& world, const ComputeDevice& device, Backend asked,
                               RunReport& report) {
  if (auto moved = move_organs_to_gpu(world, device, asked, report); !moved) return moved;
  if (auto moved = move_part_to_gpu("smoke", device, asked, report, &GpuReport::smoke_volumes,
                                    [&] { return move_smoke(world, device.context); });
      !moved)
    return moved;
  return move_part_to_gpu("heat", device, asked, report, &GpuReport::heat_organs,
                          [&] { return move_heat_to_gpu(world, device.context); });
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// One line for the person who started the run.
std::string backend_line(const RunReport& report) {
  std::string line =
      fmt::format("deformation on the {} ({})", report.backend, report.backend_reason);
  if (report.gpu)
    line += fmt::format(": {}, {}, {:.1f} MB, {}, heat of {}, ready in {:.2f} s",
                        report.gpu->device, counted(report.gpu->organs, "organ"),
                        1e-6 * static_cast<double>(report.gpu->bytes),
                        counted(report.gpu->smoke_volumes, "smoke volume"),
                        counted(report.gpu->heat_organs, "organ"), report.gpu->start_s);
  return line;
}

/// What the world and the trace tell of it afterwards; `report` knows its wall time already.
void finish_report(const World& world, const SceneDescription& scene, const Trace& trace,
                   std::uint32_t flags, RunReport& report) {
  report.duration_s = world.time();
  report.frames = world.frame;
  // Everything but the pictures counts: steps, smoke grids, writing, waiting for the writer.
  const double unseen = report.wall_s - trace.durations(stage_index(Stage::kDraw)).total -
                        trace.durations(stage_index(Stage::kEncode)).total;
  report.real_time_factor = unseen > 0.0 ? world.time() / unseen : 0.0;
  report.peak_memory_bytes = peak_memory_bytes();
  report.stages = stage_reports(trace);
  if (world.gpu)
    for (const GpuSurfaces::Pass& pass : world.gpu->passes())
      report.gpu->passes.push_back(stage_report(pass.name, quantiles(pass.seconds)));
  if (world.gpu && !world.gpu->trouble().empty())
    report.warnings.push_back(world.gpu->trouble() + ": they went on on the CPU");
  for (std::size_t s = 0; s < world.smoke.size(); ++s)
    if (const std::string& failed = world.smoke[s].volume.device_failure(); !failed.empty())
      report.warnings.push_back(failed + ": that smoke went on on the CPU");
  for (std::size_t b = 0; b < world.organ_burns.size(); ++b)
    if (const std::string& failed = world.organ_burns[b].heat.device_failure(); !failed.empty())
      report.warnings.push_back(
          fmt::format("{}: that of organ \"{}\" went on on the CPU", failed,
                      world.organ_bodies.find(world.organ_burns.owner(b))->name));
  describe_world(world, scene, report);
  for (std::uint32_t bit = 1; bit != 0 && bit <= flags; bit <<= 1)
    if (flags & bit) report.flags.push_back(flag_text(static_cast<FrameFlag>(bit)));
}

}  // namespace

Result<RunReport> run_scene(const SceneDescription& scene_in,
                            const std::map<std::string, Tissue>& tissues,
                            const RunOptions& options) {
  const Stopwatch whole;
  SceneDescription scene = scene_in;
  if (!smokes(scene)) scene.smoke.clear();
  const bool pictures = options.render && scene.camera.has_value();

  std::optional<oneapi::tbb::global_control> threads;
  if (options.threads > 0)
    threads.emplace(oneapi::tbb::global_control::max_allowed_parallelism, options.threads);
  if (!pictures && !options.passes.empty()) {
    return failure(options.render ? "--passes: found a scene without camera, expected one"
                                  : "--passes: found --no-render, expected pictures to be drawn");
  }
  if (auto writable = check_out(options.out); !writable) return std::unexpected(writable.error());

  RunReport report = begun_report(scene_in, options);
  // What could be missing on this machine is asked for before minutes of preparation.
  auto device = open_compute_device(options.backend, pictures);
  if (!device) return std::unexpected(device.error());
  report.backend = name_of(device->decision.backend);
  report.backend_reason = device->decision.reason;
  if (!device->decision.warning.empty()) report.warnings.push_back(device->decision.warning);
  std::unique_ptr<Studio> studio;
  if (pictures) {
    auto opened = open_studio(scene, options, device->context);
    if (!opened) return std::unexpected(opened.error());
    studio = std::move(*opened);
    report.renderer = studio->renderer->device();
  }

  std::optional<ProgressBar> bar;
  const auto progress_for = [&](const char* title) {
    bar.reset();
    if (!options.quiet) bar.emplace(title);
    return options.quiet ? until_interrupted() : bar->progress();
  };
  auto built = build_world(scene, tissues, {options.assets, options.use_cache},
                           progress_for("preparing"), report.warnings);
  bar.reset();
  if (!built) return std::unexpected(built.error());
  World& world = **built;
  auto haptics = HapticTools::create(scene, world, {});
  if (!haptics) return std::unexpected(haptics.error());
  world.haptics = *haptics;
  if (world.haptics) world.haptics->publish(world, 0);
  if (auto moved = move_world_to_gpu(world, *device, options.backend, report); !moved)
    return std::unexpected(moved.error());
  if (!options.quiet) fmt::print(stderr, "{}\n", backend_line(report));
  report.prepare_s = whole.seconds();
  if (auto opened = open_folder(options.out, pictures, !scene.smoke.empty(), options.vtk,
                                !options.passes.empty());
      !opened)
    return std::unexpected(opened.error());

  std::unique_ptr<SmokeWriter> writer;
  if (!scene.smoke.empty()) writer = std::make_unique<SmokeWriter>();
  std::vector<std::string> names;
  for (const InstrumentDescription& tool : scene.instruments) names.push_back(tool.name);
  auto forces = ForcesCsv::create(options.out / "forces.csv", names);
  if (!forces) return std::unexpected(forces.error());

  Trace trace({kStageNames.begin(), kStageNames.end()});
  const auto frames = static_cast<std::uint64_t>(
      std::llround(scene.duration * static_cast<double>(kFramesPerSecond)));
  trace.reserve(frames * kStageNames.size());
  const std::set<std::uint64_t> wanted = wanted_pictures(options.snapshots, frames);
  StateHash hash;
  std::uint32_t flags = 0;
  std::vector<TipSample> samples(names.size());
  ReviewRecorder recorder(world, scene);
  Trainee trainee(world, scene);
  LesionCurve lesion(world, scene);
  std::optional<VtkSeries> surfaces;
  if (options.vtk) surfaces.emplace(options.out / "vtk", world);
  Sight sight(scene);
  const std::shared_ptr<EglContext> context = studio ? studio->context : device->context;
  const Stopwatch loop;
  const Progress progress = progress_for("simulating");
  Result<void> status;
  for (std::uint64_t k = 1; k <= frames && status; ++k) {
    if (!progress(static_cast<double>(k - 1) / static_cast<double>(frames), "stepping")) break;
    if (k == options.lose_context_at && context) context->declare_lost();
    flags |= step_frame(world, trace).flags;
    {
      const StageTimer timer(trace, stage_index(Stage::kRecord), world.frame);
      for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = {world.instrument_states[i].tip, world.instrument_contacts[i].force};
      forces->add(world.time(), samples);
      recorder.add_frame(world, samples);
      trainee.add_frame(world);
      lesion.add_frame(world);
      hash.add_frame(world);
    }
    if (k % kFramesPerPicture != 0) continue;
    const std::uint64_t picture = k / kFramesPerPicture - 1;
    if (writer) {
      const StageTimer timer(trace, stage_index(Stage::kSplatSmoke), world.frame);
      splat_smoke(world);
      sight.look(world);
    }
    if (!options.snapshots.empty() && !wanted.contains(picture)) continue;
    if (writer) {
      const StageTimer timer(trace, stage_index(Stage::kWriteVolumes), world.frame);
      write_volumes(*writer, world, scene, options.out, picture);
      status = writer->status();
    }
    if (surfaces && status) {
      const StageTimer timer(trace, stage_index(Stage::kWriteSurfaces), world.frame);
      status = surfaces->add(world, picture);
    }
    if (studio && status)
      status = take_picture(*studio, world, scene, options, trace, recorder, report.warnings);
  }
  bar.reset();
  if (!status) return std::unexpected(status.error());
  // Shorter than two frames, or stopped before: there is nothing to film.
  const bool filmed = studio && studio->film && studio->pictures > 0;
  if (filmed)
    if (auto finished = studio->film->finish(); !finished) return std::unexpected(finished.error());
  if (writer)
    if (auto finished = writer->finish(); !finished) return std::unexpected(finished.error());
  if (studio && studio->passes)
    if (auto finished = studio->passes->finish(); !finished)
      return std::unexpected(finished.error());
  if (surfaces)
    if (auto finished = surfaces->finish(); !finished) return std::unexpected(finished.error());
  if (auto finished = forces->finish(); !finished) return std::unexpected(finished.error());
  if (auto written = lesion.write(options.out); !written) return std::unexpected(written.error());

  report.complete = world.frame == frames;
  report.pictures = studio ? studio->pictures : 0;
  report.state_hash = hash.finish(world);
  report.wall_s = loop.seconds();
  finish_report(world, scene, trace, flags, report);
  recorder.describe(report);
  report.smoke.time_in_smoke = sight.time_in_smoke();
  trainee.describe(world, report);
  report.smoke.volumes = writer ? static_cast<std::size_t>(writer->written()) : 0;
  report.smoke.writing_s = writer ? writer->seconds() : 0.0;

  if (auto written = trace.write(options.out / "profile.json", "viscera"); !written)
    return std::unexpected(written.error());
  if (auto written = write_report(options.out / "report.json", report); !written)
    return std::unexpected(written.error());
  auto review = recorder.finish(trace, report, filmed ? "film.mp4" : "");
  if (!review) return std::unexpected(review.error());
  if (auto written = write_review(options.out / "review.html", *review); !written)
    return std::unexpected(written.error());
  return report;
}

}  // namespace viscera
