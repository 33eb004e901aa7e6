#include "engine/run.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <thread>

#include "engine/frame.h"
#include "engine/io/atomic_file.h"
#include "engine/io/film.h"
#include "engine/io/forces_csv.h"
#include "engine/io/interrupt.h"
#include "engine/io/png_file.h"
#include "engine/io/progress_bar.h"
#include "engine/io/review.h"
#include "engine/io/smoke_file.h"
#include "engine/render/renderer.h"
#include "engine/state_hash.h"
#include "engine/systems/view.h"
#include "engine/world.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// Removes numbered files of an older run, so that no frame of it mixes with this one's.
void clear_numbered(const fs::path& folder, const std::string& extension) {
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() == extension &&
        stem.find_first_not_of("0123456789") == std::string::npos)
      fs::remove(entry.path(), error);
  }
}

/// Makes room for a run in a folder that may hold an older one, whose files go all together.
Result<void> open_folder(const fs::path& out, bool pictures, bool smoke) {
  if (auto made = check_out_folder(out); !made) return made;
  clear_numbered(out / "frames", ".png");
  clear_numbered(out / "smoke", ".vdb");
  std::error_code ignored;
  for (const char* file : {"film.mp4", "forces.csv", "profile.json", "report.json", "review.html"})
    fs::remove(out / file, ignored);
  if (pictures)
    if (auto made = check_out_folder(out / "frames"); !made) return made;
  if (smoke)
    if (auto made = check_out_folder(out / "smoke"); !made) return made;
  return {};
}

/// Everything a picture needs, made only when pictures are wanted.
struct Studio {
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<Film> film;         ///< none for snapshots
  Endoscope endoscope;
  Picture picture;
  std::uint64_t pictures = 0;
};

Result<std::unique_ptr<Studio>> open_studio(const SceneDescription& scene,
                                            const RunOptions& options) {
  RenderOptions render;
  render.width = options.width;
  render.height = options.height;
  auto renderer = Renderer::create(render);
  if (!renderer) return std::unexpected(renderer.error());
  auto studio = std::make_unique<Studio>(
      Studio{std::move(*renderer), nullptr, Endoscope(*scene.camera), {}, 0});
  if (!options.snapshots.empty()) return studio;
  auto film = Film::start(options.out / "film.mp4", options.width, options.height);
  if (!film) return std::unexpected(film.error());
  studio->film = std::move(*film);
  return studio;
}

Result<void> take_picture(Studio& studio, const World& world, const SceneDescription& scene,
                          const fs::path& out, Trace& trace) {
  {
    const StageTimer timer(trace, stage_index(Stage::kDraw), world.frame);
    const FrameView view = make_view(world, scene, studio.endoscope, studio.pictures);
    if (auto drawn = studio.renderer->draw(view, studio.picture); !drawn) return drawn;
  }
  const StageTimer timer(trace, stage_index(Stage::kEncode), world.frame);
  const Picture& p = studio.picture;
  if (studio.film)
    if (auto added = studio.film->add(p.rgb); !added) return added;
  const fs::path file = out / "frames" / fmt::format("{:04}.png", world.frame / kFramesPerPicture - 1);
  ++studio.pictures;
  return write_png(file, p.width, p.height, p.rgb);
}

/// Whether a picture is due: always for a film; once for each snapshot's time.
bool wanted(const std::vector<double>& snapshots, const World& world) {
  if (snapshots.empty()) return true;
  const double before =
      1e-3 * static_cast<double>(last_tick_of_frame(world.frame - kFramesPerPicture));
  return std::any_of(snapshots.begin(), snapshots.end(), [&](double time) {
    return time > before + 1e-9 && time <= world.time() + 1e-9;
  });
}

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
      return "an organ met a non-finite value and is frozen: check its material and the tool path";
    case FrameFlag::kContactNotConverged:
      return "contact didn't settle in some frame: smaller tool steps or fewer tools on one spot";
    case FrameFlag::kOutOfReach:
      return "a tip touched tissue that its path had not announced, without response";
    case FrameFlag::kGripSlipped:
      return "a closed jaw slid over the tissue: the pull passed its grip limit";
    case FrameFlag::kSmokeFull:
      return "a smoke volume was full; its oldest particles ended: raise max_particles";
  }
  return {};
}

void plot_frame(const World& world, const std::vector<TipSample>& samples, Review& review) {
  for (std::size_t i = 0; i < samples.size(); ++i)
    review.charts[0].curves[i].add(world.time(), samples[i].force.norm());
  std::size_t curve = 0;
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o)
    if (world.organ_bodies[o].model->touchable_anywhere())
      review.charts[1].curves[curve++].add(world.time(),
                                           1e3 * world.organ_states[o].greatest_displacement);
}

void describe_world(const World& world, RunReport& report) {
  for (const OrganBody& organ : world.organ_bodies) {
    const OrganModel& model = *organ.model;
    report.organs.push_back({organ.name, model.cloud.size(), model.cloud.surface_count,
                             model.surface.triangles.size(), model.prepare_s, model.cache_hit,
                             model.memory_bytes()});
    if (!model.touchable_anywhere())
      report.skipped.push_back({"elasticity of " + organ.name,
                                model.deformable() ? "nothing touches it"
                                                   : "scenery, or out of every instrument's reach"});
  }
  for (const SmokeBody& smoke : world.smoke)
    report.smoke.particles_max = std::max(report.smoke.particles_max, smoke.most_particles);
  report.smoke.volumes = world.smoke.size();
}

}  // namespace

bool burns(const SceneDescription& scene) {
  return std::any_of(
      scene.instruments.begin(), scene.instruments.end(), [](const InstrumentDescription& tool) {
        return tool.kind == InstrumentKind::kHook &&
               std::any_of(tool.path.begin(), tool.path.end(),
                           [](const InstrumentKey& key) { return key.power > 0.0; });
      });
}

std::vector<SkippedReport> skipped_parts(const SceneDescription& scene, bool render) {
  std::vector<SkippedReport> skipped;
  if (!render) skipped.push_back({"rendering", "--no-render: no EGL context, no film"});
  else if (!scene.camera) skipped.push_back({"rendering", "the scene has no camera"});
  if (!burns(scene)) skipped.push_back({"heat", "no hook carries current"});
  if (scene.smoke.empty()) skipped.push_back({"smoke", "the scene has no smoke volume"});
  else if (!burns(scene)) skipped.push_back({"smoke", "nothing burns: no hook carries current"});
  skipped.push_back({"haptics", "no instrument is a haptic tool"});
  return skipped;
}

Result<RunReport> run_scene(const SceneDescription& scene_in,
                            const std::map<std::string, Tissue>& tissues,
                            const RunOptions& options) {
  const Stopwatch whole;
  SceneDescription scene = scene_in;
  if (!burns(scene)) scene.smoke.clear();
  const bool pictures = options.render && scene.camera.has_value();

  std::optional<oneapi::tbb::global_control> threads;
  const int available = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  if (options.threads > 0)
    threads.emplace(oneapi::tbb::global_control::max_allowed_parallelism, options.threads);
  if (auto writable = check_out_folder(options.out); !writable)
    return std::unexpected(writable.error());

  RunReport report;
  report.version = VISCERA_VERSION;
  report.command = options.command;
  report.scene = scene.file.string();
  report.title = scene.title;
  report.seed = scene.seed;
  report.threads = options.threads > 0 ? options.threads : available;
  report.backend = "cpu";
  report.machine = this_machine();
  report.skipped = skipped_parts(scene_in, options.render);

  WorldOptions world_options;
  world_options.prepare = {options.assets, options.use_cache};
  WorldNotes notes;
  std::optional<ProgressBar> bar;
  const auto progress_for = [&](const char* title) {
    bar.reset();
    if (!options.quiet) bar.emplace(title);
    return options.quiet ? Progress([](double, std::string_view) { return !interrupted(); })
                         : bar->progress();
  };
  auto built = build_world(scene, tissues, world_options, progress_for("preparing"), notes);
  bar.reset();
  if (!built) return std::unexpected(built.error());
  World& world = **built;
  report.warnings = notes.warnings;
  report.prepare_s = whole.seconds();
  if (auto opened = open_folder(options.out, pictures, !scene.smoke.empty()); !opened)
    return std::unexpected(opened.error());

  std::unique_ptr<Studio> studio;
  if (pictures) {
    auto opened = open_studio(scene, options);
    if (!opened) return std::unexpected(opened.error());
    studio = std::move(*opened);
    report.renderer = studio->renderer->device();
  }
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
  StateHash hash;
  std::uint32_t flags = 0;
  std::vector<TipSample> samples(names.size());
  Review review;
  review.charts = {{"Force on the instruments", "N", {}}, {"Greatest displacement", "mm", {}}};
  for (const std::string& name : names) review.charts[0].curves.emplace_back(name);
  for (const OrganBody& organ : world.organ_bodies)
    if (organ.model->touchable_anywhere()) review.charts[1].curves.emplace_back(organ.name);
  const Stopwatch loop;
  const Progress progress = progress_for("simulating");
  Result<void> status;
  for (std::uint64_t k = 1; k <= frames && status; ++k) {
    if (!progress(static_cast<double>(k - 1) / static_cast<double>(frames), "stepping")) break;
    flags |= step_frame(world, trace).flags;
    {
      const StageTimer timer(trace, stage_index(Stage::kRecord), world.frame);
      for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = {world.instrument_states[i].tip, world.instrument_contacts[i].force};
      forces->add(world.time(), samples);
      plot_frame(world, samples, review);
      hash.add_frame(world);
    }
    if (k % kFramesPerPicture != 0 || !wanted(options.snapshots, world)) continue;
    const std::uint64_t picture = k / kFramesPerPicture - 1;
    if (writer) {
      {
        const StageTimer timer(trace, stage_index(Stage::kSplatSmoke), world.frame);
        splat_smoke(world);
      }
      const StageTimer timer(trace, stage_index(Stage::kWriteVolumes), world.frame);
      write_volumes(*writer, world, scene, options.out, picture);
    }
    if (studio) status = take_picture(*studio, world, scene, options.out, trace);
  }
  bar.reset();
  if (!status) return std::unexpected(status.error());
  // Shorter than two frames, or stopped before: there is nothing to film.
  const bool filmed = studio && studio->film && studio->pictures > 0;
  if (filmed)
    if (auto finished = studio->film->finish(); !finished) return std::unexpected(finished.error());
  if (writer)
    if (auto finished = writer->finish(); !finished) return std::unexpected(finished.error());
  if (auto finished = forces->finish(); !finished) return std::unexpected(finished.error());

  report.duration_s = world.time();
  report.frames = world.frame;
  report.complete = world.frame == frames;
  report.pictures = studio ? studio->pictures : 0;
  report.state_hash = hash.finish(world);
  report.wall_s = loop.seconds();
  double stepping = 0.0;
  for (int s = 0; s <= stage_index(Stage::kRecord); ++s) stepping += trace.durations(s).total;
  report.real_time_factor = stepping > 0.0 ? world.time() / stepping : 0.0;
  report.peak_memory_bytes = peak_memory_bytes();
  report.stages = stage_reports(trace);
  describe_world(world, report);
  for (std::uint32_t bit = 1; bit != 0 && bit <= flags; bit <<= 1)
    if (flags & bit) report.flags.push_back(flag_text(static_cast<FrameFlag>(bit)));

  if (auto written = trace.write(options.out / "profile.json", "viscera"); !written)
    return std::unexpected(written.error());
  if (auto written = write_report(options.out / "report.json", report); !written)
    return std::unexpected(written.error());
  review.report = report;
  if (filmed) review.film = "film.mp4";
  if (auto written = write_review(options.out / "review.html", review); !written)
    return std::unexpected(written.error());
  return report;
}

}  // namespace viscera
