#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/parting/parting.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
std::vector<ReportSection> parting_report(const World& world) {
  const Pool<OrganCut>& cuts = world.all<OrganCut>();
  if (cuts.size() == 0) return {};
  nlohmann::ordered_json organs = nlohmann::ordered_json::array();
  double area = 0.0, deepest = 0.0;
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    const Entity organ = cuts.owner(c);
    const OrganCut& cut = cuts[c];
    const OrganLeft& left = *world.find<OrganLeft>(organ);
    const OrganModel& model = *world.find<OrganBody>(organ)->model;
    const TriangleSurface& whole = world.find<Cuttable>(organ)->organ->whole->surface;
    const double depth = left.depths.empty() ? 0.0 : std::ranges::max(left.depths);
    area += cut.area;
    deepest = std::max(deepest, depth);
    nlohmann::ordered_json one = {{"organ", world.find<OrganBody>(organ)->name},
                                  {"cut_area_m2", cut.area},
                                  {"depth_m", depth},
                                  {"pieces", closed_pieces(model.surface).size()},
                                  {"taken_m3", volume(whole) - volume(model.surface)},
                                  {"crumbs_m3", left.crumbs},
                                  {"work_J", cut.work},
                                  {"bodies", cut.bodies},
                                  {"refused", cut.refused},
                                  {"twins", model.figures.twins},
                                  {"greatest_preparation_s", left.greatest_seconds}};
    if (!left.refusal.empty()) one["refusal"] = left.refusal;
    organs.push_back(std::move(one));
  }
  return {report_section(
      "parting", {{"cut_area_m2", area}, {"depth_m", deepest}, {"organs", std::move(organs)}})};
}

}  // namespace viscera
