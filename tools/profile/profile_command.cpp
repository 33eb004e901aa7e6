#include "tools/profile/profile_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/memory_limit.h"
#include "engine/io/progress_bar.h"
#include "engine/io/report.h"
#include "engine/simulator/build.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"
#include "tools/profile/profile_report.h"

namespace viscera {
namespace {

constexpr double kMostSeconds = 3600.0;
constexpr int kRounds = 3;
/// An organ takes no less, whatever is too little to be weighed [bytes].
constexpr double kLeastOrganBytes = 10e3;

Result<void> check_options(const SceneDescription& scene, const ProfileOptions& options) {
  Error mistakes;
  const auto expect = [&](bool right, std::string message) {
    if (!right) mistakes.messages.push_back(std::move(message));
  };
  expect(!options.organs.empty(), "--organs: found none, expected numbers of organs");
  for (const int organs : options.organs)
    expect(organs >= 1, fmt::format("--organs: found {}, expected 1 or more", organs));
  expect(options.touched >= 0,
         fmt::format("--touched: found {}, expected 0 or more", options.touched));
  expect(options.seconds >= scene.steps.step() && options.seconds <= kMostSeconds,
         fmt::format("--seconds: found {:g}, expected from {:.3f} (a frame) to {:g}",
                     options.seconds, scene.steps.step(), kMostSeconds));
  const std::string file = scene.file.string();
  expect(!scene.organs.empty(), file + ": organs: found none, expected an organ to repeat");
  expect(options.touched == 0 || !scene.instruments.empty(),
         file + ": instruments: found none, expected one that touches (or --touched 0)");
  expect(!options.render || scene.camera.has_value(),
         file + ": camera: found none, expected one for --render");
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

/// The organs that are touched longest come first, so that the touched ones are the first.
std::vector<std::size_t> order_of(const SceneItself& itself) {
  std::vector<std::size_t> order(itself.touches.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return itself.touches[a] > itself.touches[b];
  });
  return order;
}

/// Whether the tools really touch the organs that they are to touch.
Result<void> check_touches(const ProfileBench& bench, const SceneItself& itself, int touched) {
  int found = 0;
  for (int berth = 0; berth < touched; ++berth)
    found += itself.touches[bench.berths.organ_at(static_cast<std::size_t>(berth))] > 0;
  if (found == touched) return {};
  const auto ever = std::count_if(itself.touches.begin(), itself.touches.end(),
                                  [](std::size_t frames) { return frames > 0; });
  return failure(fmt::format(
      "--touched: found {}, but within {:.2f} s the instruments of {} touch {} of its {} organs, "
      "expected at most as many, or more --seconds",
      touched, bench.scene.steps.time_after(bench.frames), bench.scene.file.string(), ever,
      itself.touches.size()));
}

/// Refuses more organs than memory holds before they are placed. What an organ takes is weighed on
/// the scene's own, placed once and twice.
Result<void> check_memory(const ProfileBench& bench, int most) {
  const std::size_t few = bench.models.size();
  std::uint64_t bytes[2] = {0, 0};
  for (const std::size_t sets : {1u, 2u}) {
    auto weighed = memory_of(bench, {sets * few, 0, 1}, 0);
    if (!weighed) return std::unexpected(weighed.error());
    bytes[sets - 1] = *weighed;
  }
  const double each =
      std::max(kLeastOrganBytes, (static_cast<double>(bytes[1]) - static_cast<double>(bytes[0])) /
                                     static_cast<double>(few));
  MemoryBudget budget;
  budget.keep(bytes[0]);
  auto fits = budget.check(static_cast<std::uint64_t>(each * most), fmt::format("{} organs", most),
                           "name fewer");
  if (!fits) return failure("--organs: " + fits.error().text());
  return {};
}

/// Why cases without any touch have no cost of a touched organ; nothing where there is one.
std::string why_not_touched(const ProfileBench& bench, const ProfileReport& report) {
  for (const ProfileCase& one : report.touched)
    if (std::ranges::any_of(one.organs_touched, [](std::size_t organs) { return organs > 0; }))
      return {};
  if (report.touched.empty()) return {};
  const OrganDescription& organ = bench.scene.organs[bench.berths.organ_at(0)];
  return fmt::format(
      "what a touched organ costs isn't measured: without its neighbours and links {} isn't met by "
      "the instruments within {:.2f} s",
      organ.name, report.seconds);
}

/// Which case is at work; the measurements ask for Ctrl-C themselves.
class CaseProgress {
 public:
  CaseProgress(const Progress& progress, std::size_t cases) : progress_(progress), cases_(cases) {}
  void next(std::string_view what) {
    progress_(static_cast<double>(done_++) / static_cast<double>(cases_), what);
  }

 private:
  const Progress& progress_;
  std::size_t cases_, done_ = 0;
};

Result<void> measure_memory(const ProfileBench& bench, const std::vector<Occupancy>& occupancies,
                            std::uint64_t before, CaseProgress& progress, ProfileReport& report) {
  for (const Occupancy& occupancy : occupancies) {
    progress.next("weighing");
    auto bytes = memory_of(bench, occupancy, before);
    if (!bytes) return std::unexpected(bytes.error());
    report.memory.push_back({occupancy.organs, *bytes});
  }
  return {};
}

/// All cases once a round, so that a disturbance of the machine falls on all of them.
Result<void> measure_steps(const ProfileBench& bench, const std::filesystem::path& trace_file,
                           CaseProgress& progress, ProfileReport& report) {
  std::vector<ProfileCase*> all;
  for (ProfileCase& one : report.idle) all.push_back(&one);
  for (ProfileCase& one : report.touched) all.push_back(&one);
  for (int round = 0; round < kRounds; ++round) {
    for (ProfileCase* one : all) {
      progress.next("stepping");
      const bool kept = !trace_file.empty() && one == all.back() && round + 1 == kRounds;
      std::unique_ptr<Trace> trace;
      if (auto done = step_case(bench, *one, kept ? &trace : nullptr); !done) return done;
      if (!trace) continue;
      if (auto written = trace->write(trace_file, "viscera"); !written) return written;
    }
  }
  return {};
}

Result<void> measure_pictures(const ProfileBench& bench, CaseProgress& progress,
                              ProfileReport& report) {
  for (ProfileCase& one : report.touched.empty() ? report.idle : report.touched) {
    progress.next("drawing");
    auto device = draw_case(bench, one);
    if (!device) return std::unexpected(device.error());
    report.renderer = *device;
  }
  return {};
}

}  // namespace

Result<void> profile_scene(const SceneDescription& scene,
                           const std::map<std::string, Tissue>& tissues,
                           const ProfileOptions& options, std::ostream& out) {
  if (auto sound = check_options(scene, options); !sound) return sound;
  if (auto writable = check_outputs({options.json, options.trace}, options.plots); !writable)
    return writable;
  const std::uint64_t before = resident_bytes();
  auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  std::vector<std::string> warnings;
  std::optional<ProgressBar> bar;
  bar.emplace("preparing");
  auto models = prepare_organs(scene, *instruments, tissues, {assets_folder(), true},
                               bar->progress(), warnings);
  bar.reset();
  if (!models) return std::unexpected(models.error());
  for (const std::string& warning : warnings) out << "warning: " << warning << '\n';

  ProfileBench bench{scene,
                     tissues,
                     *models,
                     {{}, occupied_by(scene, *instruments, *models)},
                     scene.steps.steps_in(options.seconds)};
  ProfileReport report;
  report.scene = scene.name;
  report.machine = this_machine().cpu;
  report.cores = this_machine().cores;
  report.rounds = kRounds;
  report.seconds = bench.scene.steps.time_after(bench.frames);
  report.scene_organs = scene.organs.size();
  std::vector<int> counts = options.organs;
  std::sort(counts.begin(), counts.end());
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  const auto touched = static_cast<std::size_t>(options.touched);
  const std::size_t tools = std::max<std::size_t>(1, touched);
  std::vector<Occupancy> occupancies;
  for (const int count : counts) {
    const auto organs = static_cast<std::size_t>(count);
    occupancies.push_back({organs, touched, tools});
    report.idle.emplace_back(Occupancy{organs, 0, tools});
    if (touched == 0) continue;
    if (touched <= organs) {
      report.touched.emplace_back(occupancies.back());
    } else {
      report.left_out.push_back(fmt::format("{} organs with {} touched", organs, touched));
      occupancies.back().touched = 0;
    }
  }
  bar.emplace("profiling");
  const Progress shown = bar->progress();
  CaseProgress progress(shown, 1 + occupancies.size() * (1 + (options.render ? 1 : 0)) +
                                   kRounds * (report.idle.size() + report.touched.size()));
  progress.next("stepping the scene itself");
  auto itself = step_scene_itself(scene, std::move(*instruments), *models, tissues, bench.frames);
  if (!itself) return std::unexpected(itself.error());
  report.itself = *itself;
  bench.berths.order = order_of(*itself);
  if (auto sound = check_touches(bench, *itself, options.touched); !sound) return sound;
  if (auto fits = check_memory(bench, counts.back()); !fits) return fits;

  if (auto done = measure_memory(bench, occupancies, before, progress, report); !done) return done;
  if (auto done = measure_steps(bench, options.trace, progress, report); !done) return done;
  report.not_touched = why_not_touched(bench, report);
  if (options.render)
    if (auto done = measure_pictures(bench, progress, report); !done) return done;
  bar.reset();

  print(report, out);
  if (!options.plots.empty())
    if (auto drawn = draw_plots(report, options.plots); !drawn) return drawn;
  if (options.json.empty()) return {};
  return write_file(options.json, to_json_text(report));
}

}  // namespace viscera
