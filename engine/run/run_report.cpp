#include "engine/run/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <thread>

#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/gpu_surfaces.h"
#include "engine/simulation/feature.h"
#include "engine/simulator/build.h"

namespace viscera {
namespace {

template <class T>
void append(std::vector<T>& all, std::vector<T> more) {
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

void describe_organs(const World& world, const SceneDescription& scene, RunReport& report) {
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const OrganBody& organ = world.all<OrganBody>()[o];
    const OrganModel& model = *organ.model;
    OrganReport one;
    one.name = organ.name;
    if (model.finite)
      one.response = "finite";
    else if (scene.organs[o].response == Response::kLocal && scene.organs[o].deformable)
      one.response = "local";
    else if (model.deformable())
      one.response = "linear";
    one.nodes = model.cloud.size();
    one.surface_nodes = model.cloud.surface_count;
    one.triangles = model.surface.triangles.size();
    one.prepare_s = model.prepare_s;
    one.cache_hit = model.cache_hit;
    one.memory_bytes = model.memory_bytes();
    const ColumnFigures columns = model.column_figures();
    one.columns_prepared = columns.prepared;
    one.columns_on_demand = columns.on_demand;
    one.on_demand_s = columns.on_demand_s;
    if (model.deformable()) one.preparation = model.figures;
    one.half_precision = model.in_half_precision();
    one.storage_error = model.half_columns.error;
    one.saved_bytes = model.saved_bytes();
    report.organs.push_back(std::move(one));
    if (!model.deformable()) report.skipped.push_back(skipped_elasticity(scene.organs[o]));
  }
}

/// The features, in the order in which a step is done with them.
std::vector<const Feature*> features_by_step() {
  std::vector<const Feature*> features;
  for (const Feature& feature : all_features()) features.push_back(&feature);
  const std::vector<std::string_view>& owners = step_schedule().owners();
  std::ranges::stable_sort(features, {}, [&](const Feature* feature) {
    return owners.rend() - std::ranges::find(owners.rbegin(), owners.rend(), feature->name);
  });
  return features;
}

}  // namespace

std::vector<SkippedReport> skipped_parts(const SceneDescription& scene, bool render) {
  std::vector<SkippedReport> skipped;
  if (!render)
    skipped.push_back({"rendering", "--no-render: no pictures, no film"});
  else if (!scene.camera)
    skipped.push_back({"rendering", "the scene has no camera"});
  for (const Feature* feature : features_by_step())
    if (feature->skipped) append(skipped, feature->skipped(scene));
  return skipped;
}

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

namespace {

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

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

void finish_report(const World& world, const SceneDescription& scene, const Trace& trace,
                   const RunBook& book, RunReport& report) {
  report.duration_s = world.time();
  report.frames = world.frame();
  // Everything but the pictures counts: steps, smoke grids, writing, waiting for the writer.
  const double unseen = report.wall_s - trace.durations(stage_index(RunStage::kDraw)).total -
                        trace.durations(stage_index(RunStage::kEncode)).total;
  report.real_time_factor = unseen > 0.0 ? world.time() / unseen : 0.0;
  report.peak_memory_bytes = peak_memory_bytes();
  report.stages = stage_reports(trace);
  const GpuOrgans* gpu = world.one<GpuOrgans>();
  if (gpu)
    for (const GpuSurfaces::Pass& pass : gpu->surfaces->passes())
      report.gpu->passes.push_back(stage_report(pass.name, quantiles(pass.seconds)));
  describe_organs(world, scene, report);
  for (const Feature& feature : world.model().features()) {
    if (feature.report) append(report.sections, feature.report(world));
    if (feature.warnings) append(report.warnings, feature.warnings(world));
  }
  FlagSet raised = book.flags;
  raised.order(flags_of(world.model().features()));
  for (const FrameFlag& flag : raised) report.flags.emplace_back(flag.text);
  report.not_finite = book.strays.first;
  if (book.strays.count > report.not_finite.size())
    report.not_finite.push_back(
        fmt::format("and {} more", book.strays.count - report.not_finite.size()));
}

}  // namespace viscera
