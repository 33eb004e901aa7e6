#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/cautery/cautery.h"

namespace viscera {

bool anything_burns(const SceneDescription& scene) {
  return std::ranges::any_of(scene.instruments, carries_current);
}

std::optional<CauteryFigures> cautery_figures(const World& world) {
  if (!world.has<BurnTrace>()) return {};
  CauteryFigures figures;
  double residual = 0.0;
  for (const BurnTrace& trace : world.all<BurnTrace>()) figures.generated += trace.generated;
  for (const OrganBurn& burn : world.all<OrganBurn>()) {
    const HeatBook book = burn.heat.book();
    figures.delivered += book.delivered;
    figures.metabolic += book.metabolic;
    figures.stored += book.stored;
    figures.latent += book.latent;
    figures.perfused += book.perfused;
    figures.lost += book.vapour + book.pyrolysis + book.gas + book.instrument + book.boundary;
    residual += book.residual();
  }
  if (figures.delivered > 0.0) figures.residual = residual / figures.delivered;
  return figures;
}

std::vector<BurnFigures> burn_figures(const World& world) {
  const Pool<OrganBurn>& burns = world.all<OrganBurn>();
  std::vector<BurnFigures> all;
  for (std::size_t b = 0; b < burns.size(); ++b) {
    const Bioheat& heat = burns[b].heat;
    all.push_back({.organ = burns.owner(b),
                   .vaporised = heat.vaporised_water() + heat.vaporised_tissue(),
                   .smoke = burns[b].smoke,
                   .above_60 = burns[b].greatest_hot,
                   .coagulated = heat.coagulated_volume(),
                   .dead = heat.dead_volume(),
                   .greatest_temperature = heat.options().body + heat.greatest_excess()});
  }
  return all;
}

/// What went beyond the tissue that is followed is for whoever watches every step to fill in.
std::vector<ReportSection> cautery_report(const World& world) {
  Json cautery;
  if (const auto figures = cautery_figures(world))
    cautery = {{"energy_generated_J", figures->generated},
               {"energy_delivered_J", figures->delivered},
               {"body_J", nullptr},
               {"sparks_J", nullptr},
               {"metabolic_J", figures->metabolic},
               {"stored_J", figures->stored},
               {"latent_J", figures->latent},
               {"perfused_J", figures->perfused},
               {"lost_J", figures->lost},
               {"residual", figures->residual}};
  Json tissue = Json::array();
  for (const BurnFigures& burn : burn_figures(world))
    tissue.push_back({{"organ", world.find<OrganBody>(burn.organ)->name},
                      {"vaporised_kg", burn.vaporised},
                      {"smoke_kg", burn.smoke},
                      {"volume_above_60C_m3", burn.above_60},
                      {"volume_coagulated_m3", burn.coagulated},
                      {"volume_dead_m3", burn.dead},
                      {"greatest_temperature_K", burn.greatest_temperature}});
  return {report_section("cautery", cautery), report_section("tissue", tissue)};
}

std::vector<std::string> cautery_warnings(const World& world) {
  const Pool<OrganBurn>& burns = world.all<OrganBurn>();
  std::vector<std::string> warnings;
  for (std::size_t b = 0; b < burns.size(); ++b)
    if (const std::string& failed = burns[b].heat.device_failure(); !failed.empty())
      warnings.push_back(fmt::format("{}: that of organ \"{}\" went on on the CPU", failed,
                                     world.find<OrganBody>(burns.owner(b))->name));
  return warnings;
}

std::vector<SkippedReport> cautery_skipped(const SceneDescription& scene) {
  if (anything_burns(scene)) return {};
  return {{"heat", "no hook carries current"}};
}

}  // namespace viscera
