#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/cautery/cautery.h"
#include "engine/features/smoke/smoke.h"

namespace viscera {
namespace {

bool smokes_steadily(const SmokeDescription& smoke) {
  return std::ranges::any_of(
      smoke.emitters, [](const EmitterDescription& emitter) { return emitter.instrument.empty(); });
}

}  // namespace

bool anything_smokes(const SceneDescription& scene) {
  const std::span<const SmokeDescription> volumes = smoke_of(scene);
  return !volumes.empty() &&
         (anything_burns(scene) || std::ranges::any_of(volumes, smokes_steadily));
}

SmokeFigures smoke_figures(const World& world) {
  SmokeFigures figures;
  for (const SmokeBody& smoke : world.all<SmokeBody>()) {
    const SmokeBook& book = smoke.volume.book();
    figures.most_particles = std::max(figures.most_particles, smoke.most_particles);
    figures.emitted += book.emitted;
    figures.airborne += smoke.volume.airborne();
    figures.background += book.background;
    figures.evacuated += book.evacuated;
    figures.leaked += book.leaked;
    figures.deposited += book.deposited;
  }
  return figures;
}

/// Whoever writes volumes or looks through the smoke fills in what it did; nobody may.
std::vector<ReportSection> smoke_report(const World& world) {
  const SmokeFigures figures = smoke_figures(world);
  return {report_section("smoke", {{"particles_max", figures.most_particles},
                                   {"volumes", 0u},
                                   {"writing_s", 0.0},
                                   {"emitted_kg", figures.emitted},
                                   {"airborne_kg", figures.airborne},
                                   {"background_kg", figures.background},
                                   {"evacuated_kg", figures.evacuated},
                                   {"leaked_kg", figures.leaked},
                                   {"deposited_kg", figures.deposited},
                                   {"time_in_smoke", nullptr},
                                   {"view_least", nullptr},
                                   {"view_at_end", nullptr}})};
}

std::vector<std::string> smoke_warnings(const World& world) {
  std::vector<std::string> warnings;
  for (const SmokeBody& smoke : world.all<SmokeBody>())
    if (const std::string& failed = smoke.volume.device_failure(); !failed.empty())
      warnings.push_back(failed + ": that smoke went on on the CPU");
  return warnings;
}

std::vector<SkippedReport> smoke_skipped(const SceneDescription& scene) {
  if (smoke_of(scene).empty()) return {{"smoke", "the scene has no smoke volume"}};
  if (!anything_smokes(scene)) return {{"smoke", "nothing burns: no hook carries current"}};
  return {};
}

}  // namespace viscera
