#include <nlohmann/json.hpp>
#include <numeric>

#include "engine/features/beds/beds.h"
#include "engine/features/beds/cut_beds.h"

namespace viscera {

std::vector<BedFigures> bed_figures(const World& world) {
  std::vector<BedFigures> all;
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    const Bed& bed = beds[b];
    const CohesiveLayer& layer = places_now(world, beds.owner(b)).layer;
    const BedState& state = *world.find<BedState>(beds.owner(b));
    BedFigures figures;
    figures.name = bed.name;
    for (std::size_t side = 0; side < 2; ++side)
      figures.between[side] = world.find<OrganBody>(bed.organs[side])->name;
    figures.bonds = layer.areas.size();
    figures.force =
        std::accumulate(state.forces.begin(), state.forces.end(), Vec3(Vec3::Zero())).norm();
    figures.greatest_force = state.greatest_force;
    for (std::size_t i = 0; i < figures.bonds; ++i) {
      const double area = layer.areas[i];
      figures.area += area;
      figures.work += layer.spent(i, state.bonds.opened[i]);
      figures.film += layer.edge(i);
      const bool torn = state.bonds.parted_by[i] || layer.film.left(state.bonds.opened[i]) == 0.0;
      if (layer.edge(i) > 0.0 && torn) figures.film_parted += layer.edge(i);
      if (holds(layer, state.bonds, i)) {
        ++figures.whole;
        continue;
      }
      figures.parted += area;
      if (state.bonds.parted_by[i] == kPartedByHeat) {
        ++figures.by_heat;
      } else if (state.bonds.parted_by[i] == kPartedByCut) {
        ++figures.by_cut;
      } else {
        ++figures.by_force;
        figures.torn += area;
      }
    }
    all.push_back(figures);
  }
  return all;
}

std::vector<ReportSection> beds_report(const World& world) {
  const std::vector<BedFigures> figures = bed_figures(world);
  if (figures.empty()) return {};
  Json list = Json::array();
  for (std::size_t b = 0; b < figures.size(); ++b) {
    const BedFigures& bed = figures[b];
    list.push_back(
        {{"name", bed.name},
         {"between", {bed.between[0], bed.between[1]}},
         {"bonds", bed.bonds},
         {"bonds_whole", bed.whole},
         {"bonds_broken", {{"force", bed.by_force}, {"heat", bed.by_heat}, {"cut", bed.by_cut}}},
         {"area_m2", bed.area},
         {"parted_m2", bed.parted},
         {"tissue_left_m3", tissue_left_on(world, world.all<Bed>().owner(b))},
         {"film_m", bed.film},
         {"film_parted_m", bed.film_parted},
         {"work_J", bed.work},
         {"greatest_force_N", bed.greatest_force}});
  }
  return {report_section("beds", list)};
}

}  // namespace viscera
