#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/cautery/bipolar.h"

namespace viscera {

namespace {

/// Integrals as yet, where figures are means.
void add(const GeneratorBook& book, CauteryFigures& figures) {
  if (!(book.time > 0.0)) return;
  figures.generated += book.generated;
  figures.body += book.body;
  figures.metal += book.metal;
  figures.gas += book.gas;
  figures.sparks += book.sparks;
  figures.least_impedance =
      figures.time > 0.0 ? std::min(figures.least_impedance, book.least) : book.least;
  figures.greatest_impedance = std::max(figures.greatest_impedance, book.greatest);
  figures.mean_impedance += book.impedance;
  figures.by_current += book.by_current;
  figures.by_voltage += book.by_voltage;
  figures.time += book.time;
}

Json seals_of(const World& world) {
  Json seals = Json::array();
  const Pool<Sealer>& all = world.all<Sealer>();
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const Seal& seal : all[i].seals)
      seals.push_back({{"instrument", world.find<InstrumentBody>(all.owner(i))->description.name},
                       {"organ", world.find<OrganBody>(seal.organ)->name},
                       {"begun_s", seal.begun},
                       {"ended_s", seal.ended},
                       {"dried", seal.dried},
                       {"coagulated", seal.coagulated},
                       {"fused", seal.fused()},
                       {"squeezed_to", seal.squeezed},
                       {"least_Ohm", seal.least},
                       {"last_Ohm", seal.last}});
  return seals;
}

Json impedance(const CauteryFigures& figures) {
  if (!(figures.time > 0.0)) return {};
  return {{"least_Ohm", figures.least_impedance},
          {"mean_Ohm", figures.mean_impedance},
          {"greatest_Ohm", figures.greatest_impedance}};
}

}  // namespace

bool anything_burns(const SceneDescription& scene) {
  return std::ranges::any_of(scene.instruments, carries_current);
}

std::optional<CauteryFigures> cautery_figures(const World& world) {
  if (!world.has<BurnTrace>()) return {};
  CauteryFigures figures;
  double residual = 0.0;
  for (const BurnTrace& trace : world.all<BurnTrace>()) add(trace.book, figures);
  if (figures.time > 0.0) {
    figures.mean_impedance /= figures.time;
    figures.by_current /= figures.time;
    figures.by_voltage /= figures.time;
  }
  for (const OrganBurn& burn : world.all<OrganBurn>()) {
    const HeatBook book = burn.heat.book();
    figures.delivered += book.delivered;
    figures.metabolic += book.metabolic;
    figures.stored += book.stored;
    figures.latent += book.latent;
    figures.perfused += book.perfused;
    figures.lost +=
        book.vapour + book.pyrolysis + book.gas + book.instrument + book.boundary + book.removed;
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

double dead_depth(const World& world, Entity organ) {
  const SurfaceTree& surface = surface_left(world, organ);
  const HeatBricks& bricks = world.find<OrganBurn>(organ)->heat.bricks();
  double deepest = 0.0;
  for (std::size_t b = 0; b < bricks.count(); ++b) {
    const HeatBrick& brick = bricks.brick(b);
    if (!brick.harmed) continue;
    for (int v = 0; v < BrickField::kVoxels; ++v)
      if (is_dead(brick, static_cast<std::size_t>(v)) && brick.geometry->fraction[v] > 0.0f)
        deepest = std::max(deepest, -surface.signed_distance(bricks.centre(brick, v)));
  }
  return deepest;
}

std::vector<ReportSection> cautery_report(const World& world) {
  Json cautery;
  if (const auto figures = cautery_figures(world))
    cautery = {{"energy_generated_J", figures->generated},
               {"energy_delivered_J", figures->delivered},
               {"by_sparks_J", figures->sparks},
               {"body_J", figures->body},
               {"sparks_metal_J", figures->metal},
               {"sparks_gas_J", figures->gas},
               {"metabolic_J", figures->metabolic},
               {"stored_J", figures->stored},
               {"latent_J", figures->latent},
               {"perfused_J", figures->perfused},
               {"lost_J", figures->lost},
               {"residual", figures->residual},
               {"time_with_current_s", figures->time},
               {"impedance", impedance(*figures)},
               {"limited_by_current", figures->by_current},
               {"limited_by_voltage", figures->by_voltage},
               {"seals", seals_of(world)}};
  Json tissue = Json::array();
  for (const BurnFigures& burn : burn_figures(world))
    tissue.push_back({{"organ", world.find<OrganBody>(burn.organ)->name},
                      {"vaporised_kg", burn.vaporised},
                      {"smoke_kg", burn.smoke},
                      {"volume_above_60C_m3", burn.above_60},
                      {"volume_coagulated_m3", burn.coagulated},
                      {"volume_dead_m3", burn.dead},
                      {"dead_depth_m", dead_depth(world, burn.organ)},
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
