#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/beds/beds.h"
#include "engine/features/beds/cut_beds.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/parting.h"
#include "engine/features/parting/perforations.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

/// Of the pieces that its body lacks [kg].
double removed_mass(const OrganCut& cut) {
  double mass = 0.0;
  for (std::size_t p = 0; p < cut.removed_used; ++p) mass += cut.removed[p].mass;
  return mass;
}

nlohmann::ordered_json organ_parted(const World& world, Entity organ, const OrganCut& cut) {
  const OrganLeft& left = *world.find<OrganLeft>(organ);
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  const TriangleSurface& whole = world.find<Cuttable>(organ)->organ->whole->surface;
  nlohmann::ordered_json one = {
      {"organ", world.find<OrganBody>(organ)->name},
      {"cut_area_m2", cut.area},
      {"torn_m2", cut.torn},
      {"depth_m", left.depths.empty() ? 0.0 : std::ranges::max(left.depths)},
      {"pieces", left.pieces.empty() ? 1 : 1 + std::ranges::max(left.pieces)},
      {"loose_pieces", model.finite->loose().pieces().size()},
      {"taken_m3", volume(whole) - volume(model.surface) - left.removed},
      {"crumbs_m3", left.crumbs},
      {"remnants_m3", cut.remnants},
      {"removed_pieces", cut.removed_used},
      {"removed_m3", left.removed},
      {"removed_kg", removed_mass(cut)},
      {"work_J", cut.work},
      {"vaporised_m3", cut.vaporised},
      {"bodies", cut.bodies},
      {"refused", cut.refused},
      {"twins", model.figures.twins},
      {"greatest_preparation_s", left.greatest_seconds}};
  if (!left.refusal.empty()) one["refusal"] = left.refusal;
  return one;
}

}  // namespace

std::vector<ReportSection> parting_report(const World& world) {
  const Pool<OrganCut>& cuts = world.all<OrganCut>();
  const std::vector<BedFigures> beds = bed_figures(world);
  const std::vector<WallFigures> walls = wall_figures(world);
  if (cuts.size() == 0 && beds.empty() && walls.empty()) return {};
  nlohmann::ordered_json organs = nlohmann::ordered_json::array(),
                         walled = nlohmann::ordered_json::array();
  double area = 0.0, torn_area = 0.0, deepest = 0.0, vaporised = 0.0, left_on_beds = 0.0;
  std::size_t pieces = 0, removed = 0, by_force = 0, by_heat = 0, by_cut = 0, perforations = 0;
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    organs.push_back(organ_parted(world, cuts.owner(c), cuts[c]));
    area += cuts[c].area;
    torn_area += cuts[c].torn;
    deepest = std::max(deepest, organs.back()["depth_m"].get<double>());
    pieces += organs.back()["pieces"].get<std::size_t>();
    removed += cuts[c].removed_used;
  }
  for (const BedFigures& bed : beds) {
    by_force += bed.by_force;
    by_heat += bed.by_heat;
    by_cut += bed.by_cut;
  }
  for (std::size_t b = 0; b < world.all<Bed>().size(); ++b)
    left_on_beds += tissue_left_on(world, world.all<Bed>().owner(b));
  for (const BurnFigures& burn : burn_figures(world)) vaporised += burn.vaporised;
  for (const WallFigures& wall : walls) {
    perforations += wall.perforations;
    walled.push_back({{"organ", world.find<OrganBody>(wall.organ)->name},
                      {"wall_m", wall.wall},
                      {"perforations", wall.perforations},
                      {"depth_m", wall.depth}});
  }
  return {report_section(
      "parting", {{"cut_area_m2", area},
                  {"torn_m2", torn_area},
                  {"depth_m", deepest},
                  {"pieces", pieces},
                  {"removed_pieces", removed},
                  {"bonds_broken", {{"force", by_force}, {"heat", by_heat}, {"cut", by_cut}}},
                  {"left_on_beds_m3", left_on_beds},
                  {"vaporised_kg", vaporised},
                  {"perforations", perforations},
                  {"organs", std::move(organs)},
                  {"walls", std::move(walled)}})};
}

}  // namespace viscera
