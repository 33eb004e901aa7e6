#include "tools/viscera/check_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <ostream>

#include "engine/features/deformation/deformation.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/links/link_places.h"
#include "engine/features/smoke/smoke_keys.h"
#include "engine/organ/elasticity_checks.h"
#include "engine/organ/organ_plan.h"
#include "engine/run/run.h"
#include "engine/simulator/build.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

std::string megabytes(std::size_t bytes) {
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6);
}

std::string held_through(const InstrumentDescription& tool) {
  const HapticDescription* haptic = haptic_of(tool);
  if (!haptic) return "";
  switch (haptic->device) {
    case HapticDescription::Device::kSimulated:
      return ", held through a simulated device";
    case HapticDescription::Device::kRecorded:
      return ", moved by the recording " + haptic->recording.string();
    case HapticDescription::Device::kNetwork:
      return fmt::format(", held through a device at port {}", haptic->port);
  }
  return "";
}

}  // namespace

Result<void> check_scene(const SceneDescription& scene,
                         const std::map<std::string, Tissue>& tissues, std::ostream& out) {
  out << fmt::format("{}: {}\n{:g} s, seed {}\n\n", scene.name, scene.title, scene.duration,
                     scene.seed);
  out << fmt::format("{:<16}{:>10}{:>8}{:>9}{:>10}{:>10}{:>12}{:>14}  {}\n", "organ", "triangles",
                     "nodes", "surface", "touchable", "prepared", "memory", "preparation", "cache");
  PrepareOptions options;
  options.assets = assets_folder();
  double seconds = 0.0;
  std::size_t memory = 0, peak = 0;
  MemoryBudget budget;
  Error mistakes;
  if (auto sound = check_together(scene, tissues); !sound) mistakes = sound.error();
  std::vector<std::string> notes;
  std::vector<SkippedReport> skipped = skipped_parts(scene, true);
  auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  std::vector<TriangleSurface> surfaces(scene.organs.size());
  for (std::size_t i = 0; i < scene.organs.size(); ++i) {
    const OrganDescription& organ = scene.organs[i];
    const auto add_mistakes = [&](const Error& error) {
      for (const std::string& message : error.messages)
        mistakes.messages.push_back(
            fmt::format("{}: organs/{} (\"{}\"): {}", scene.file.string(), i, organ.name, message));
    };
    auto plan =
        plan_organ(organ, tissue_of(organ, tissues), reach_of(*instruments, scene, organ), options);
    if (!plan) {
      add_mistakes(plan.error());
      continue;
    }
    if (auto clear = check_tips(scene, *instruments, organ, plan->begun->surface); !clear)
      mistakes.messages.insert(mistakes.messages.end(), clear.error().messages.begin(),
                               clear.error().messages.end());
    // An organ that nothing reaches has no nodes: its elasticity isn't prepared.
    if (plan->nodes > 0) {
      auto elastic =
          check_elasticity(organ, tissue_of(organ, tissues).elastic, plan->begun->surface);
      if (!elastic) add_mistakes(elastic.error());
    }
    if (auto fits = set_aside(*plan, budget); !fits) add_mistakes(fits.error());
    for (const std::string& note : plan->notes) notes.push_back(organ.name + ": " + note);
    if (organ.response == Response::kAuto && plan->response == Response::kFinite)
      notes.push_back(organ.name +
                      ": at finite strain, as what acts on it strains it far (response auto)");
    if (plan->nodes == 0) skipped.push_back(skipped_elasticity(organ));
    const double expected = plan->cached ? 0.0 : plan->prepare_s;
    seconds += expected;
    memory += plan->memory_bytes;
    if (!plan->cached) peak = std::max(peak, plan->preparation_bytes);
    if (plan->prepared_places < plan->touchable_places)
      notes.push_back(fmt::format(
          "{}: columns of {} of its {} touchable places are prepared, the others made on demand "
          "(all would take {})",
          organ.name, plan->prepared_places, plan->touchable_places,
          megabytes(9 * sizeof(float) * plan->places * plan->touchable_places)));
    out << fmt::format("{:<16}{:>10}{:>8}{:>9}{:>10}{:>10}{:>12}{:>12.1f} s  {}\n", organ.name,
                       plan->triangles, plan->nodes, plan->surface_nodes, plan->touchable_places,
                       plan->prepared_places, megabytes(plan->memory_bytes), expected,
                       plan->cached ? "yes" : "no");
    surfaces[i] = std::move(plan->begun->surface);
  }
  const std::span<const LinkDescription> links = links_of(scene);
  std::vector<LinkPlaces> places;
  std::vector<const TriangleSurface*> all;
  for (const TriangleSurface& surface : surfaces) all.push_back(&surface);
  if (mistakes.messages.empty())
    for (std::size_t i = 0; i < links.size(); ++i) {
      auto placed = place_springs(scene, i, all);
      if (placed)
        places.push_back(std::move(*placed));
      else
        mistakes.messages.push_back(placed.error().text());
    }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);

  out << fmt::format("\nmodels {}, most while preparing {}, expected preparation {:.0f} s\n",
                     megabytes(memory), megabytes(peak), seconds);
  for (std::size_t i = 0; i < links.size(); ++i)
    out << fmt::format("link {}: {} springs, {:g} N/m in all, from {} to {}\n", links[i].name,
                       places[i].springs.size(), links[i].stiffness, links[i].between[0],
                       links[i].between[1]);
  for (const InstrumentDescription& tool : scene.instruments)
    out << fmt::format("instrument {}: {} key frames{}\n", tool.name, tool.path.size(),
                       held_through(tool));
  for (const SmokeDescription& smoke : smoke_of(scene)) {
    const Vec3 cells = smoke.domain.sizes() / smoke.voxel;
    out << fmt::format("smoke {}: up to {} particles, volume {:.0f} x {:.0f} x {:.0f} voxels, {}\n",
                       smoke.name, smoke.max_particles, cells.x(), cells.y(), cells.z(),
                       megabytes(static_cast<std::size_t>(cells.prod()) * 2 * sizeof(float)));
  }
  for (const std::string& note : notes) out << note << '\n';
  out << "\nskipped:\n";
  for (const SkippedReport& part : skipped) out << fmt::format("  {}: {}\n", part.what, part.why);
  return {};
}

}  // namespace viscera
