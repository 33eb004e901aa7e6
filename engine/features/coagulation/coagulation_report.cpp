#include <nlohmann/json.hpp>

#include "engine/features/cautery/cautery.h"
#include "engine/features/coagulation/coagulation.h"

namespace viscera {

std::optional<StiffeningFigures> stiffening_of(const World& world, Entity organ) {
  const OrganChange* change = world.find<OrganChange>(organ);
  const OrganUpdate* made = world.find<OrganUpdate>(organ);
  if (!change || !made || !made->update) return {};
  const StiffnessUpdate& update = *made->update;
  StiffeningFigures figures{.greatest_factor = update.greatest_stiffness,
                            .stiffened = change->stiffened,
                            .left_out = change->left_out,
                            .updates = static_cast<int>(change->updates),
                            .nodes = update.nodes,
                            .rank = update.rank};
  if (!world.find<OrganBody>(organ)->model->finite)
    figures.greatest_shrinkage = update.greatest_shift;
  return figures;
}

/// Of every organ that heat is followed in, beside what cautery tells of it.
std::vector<ReportSection> coagulation_report(const World& world) {
  const Pool<OrganBurn>& burns = world.all<OrganBurn>();
  Json tissue = Json::array();
  for (std::size_t b = 0; b < burns.size(); ++b) {
    Json stiffening;
    if (const auto figures = stiffening_of(world, burns.owner(b)))
      stiffening = {
          {"greatest_factor", figures->greatest_factor},
          {"volume_stiffened_m3", figures->stiffened},
          {"volume_left_out_m3", figures->left_out},
          {"greatest_shrinkage_m",
           figures->greatest_shrinkage ? Json(*figures->greatest_shrinkage) : Json(nullptr)},
          {"updates", figures->updates},
          {"nodes", figures->nodes},
          {"rank", figures->rank}};
    tissue.push_back({{"organ", world.find<OrganBody>(burns.owner(b))->name},
                      {"stiffening", std::move(stiffening)}});
  }
  return {report_section("tissue", tissue)};
}

}  // namespace viscera
