#include "engine/run/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "engine/features/cautery/cautery.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/gpu_surfaces.h"
#include "engine/features/held_tools/held_tools.h"
#include "engine/features/links/links.h"
#include "engine/features/smoke/smoke.h"
#include "engine/simulation/feature.h"
#include "engine/simulator/build.h"

namespace viscera {
namespace {

std::string flag_text(FrameFlag flag) {
  switch (flag) {
    case FrameFlag::kOrganFrozen:
      return "an organ's displacement was not finite; it is frozen: prepare it afresh (--no-cache)";
    case FrameFlag::kContactNotConverged:
      return "contact had no solution in some frame, without force there: smaller tool steps, or "
             "fewer tools on one spot";
    case FrameFlag::kOutOfReach:
      return "a tip touched tissue where no place of the surface was near enough to take its "
             "force: a "
             "smaller spacing_mm";
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
  report.frame_difference = tool.agreement.ratio();
  report.frames_at_rest = tool.agreement.frames;
  report.events = tool.events;
  return report;
}

void describe_world(const World& world, const SceneDescription& scene, RunReport& report) {
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const OrganBody& organ = world.all<OrganBody>()[o];
    const OrganModel& model = *organ.model;
    OrganReport one;
    one.name = organ.name;
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
  const Pool<Link>& links = world.all<Link>();
  const std::span<const LinkDescription> described_links = links_of(scene);
  for (std::size_t l = 0; l < links.size(); ++l) {
    const Link& link = links[l];
    const auto described =
        std::find_if(described_links.begin(), described_links.end(),
                     [&](const LinkDescription& one) { return one.name == link.name; });
    report.links.push_back({link.name, described->between, described->stiffness, link.springs,
                            world.find<LinkState>(links.owner(l))->greatest_force});
  }
  if (const HapticTools* servos = servos_of(world))
    for (const HapticTool& tool : servos->tools()) report.haptics.push_back(haptic_report(tool));
  for (const SmokeBody& smoke : world.all<SmokeBody>()) {
    const SmokeBook& book = smoke.volume.book();
    report.smoke.particles_max =
        std::max<std::size_t>(report.smoke.particles_max, smoke.most_particles);
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

}  // namespace

bool smokes(const SceneDescription& scene) {
  const std::span<const SmokeDescription> volumes = smoke_of(scene);
  if (volumes.empty()) return false;
  return burns(scene) ||
         std::any_of(volumes.begin(), volumes.end(), [](const SmokeDescription& smoke) {
           return std::any_of(
               smoke.emitters.begin(), smoke.emitters.end(),
               [](const EmitterDescription& emitter) { return emitter.instrument.empty(); });
         });
}

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
  if (smoke_of(scene).empty())
    skipped.push_back({"smoke", "the scene has no smoke volume"});
  else if (!smokes(scene))
    skipped.push_back({"smoke", "nothing burns: no hook carries current"});
  if (!holds_tools(scene)) skipped.push_back({"haptics", "no instrument is a haptic tool"});
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
                   std::uint32_t flags, RunReport& report) {
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
  if (gpu && !gpu->surfaces->trouble().empty())
    report.warnings.push_back(gpu->surfaces->trouble() + ": they went on on the CPU");
  for (const SmokeBody& smoke : world.all<SmokeBody>())
    if (const std::string& failed = smoke.volume.device_failure(); !failed.empty())
      report.warnings.push_back(failed + ": that smoke went on on the CPU");
  for (std::size_t b = 0; b < world.all<OrganBurn>().size(); ++b)
    if (const std::string& failed = world.all<OrganBurn>()[b].heat.device_failure();
        !failed.empty())
      report.warnings.push_back(
          fmt::format("{}: that of organ \"{}\" went on on the CPU", failed,
                      world.find<OrganBody>(world.all<OrganBurn>().owner(b))->name));
  describe_world(world, scene, report);
  for (const Feature& feature : world.model().features())
    if (feature.report)
      for (ReportSection& section : feature.report(world))
        report.sections.emplace_back(std::move(section.key), std::move(section.json));
  for (std::uint32_t bit = 1; bit != 0 && bit <= flags; bit <<= 1)
    if (flags & bit) report.flags.push_back(flag_text(static_cast<FrameFlag>(bit)));
}

}  // namespace viscera
