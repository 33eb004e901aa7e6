#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/features/links/links.h"

namespace viscera {

std::vector<LinkFigures> link_figures(const World& world) {
  const std::span<const LinkDescription> described = links_of(world.model().scene());
  const Pool<Link>& links = world.all<Link>();
  std::vector<LinkFigures> all;
  for (std::size_t l = 0; l < links.size(); ++l) {
    const auto description = std::ranges::find(described, links[l].name, &LinkDescription::name);
    all.push_back({.name = links[l].name,
                   .between = description->between,
                   .stiffness = description->stiffness,
                   .springs = links[l].springs,
                   .greatest_force = world.find<LinkState>(links.owner(l))->greatest_force});
  }
  return all;
}

std::vector<ReportSection> links_report(const World& world) {
  Json list = Json::array();
  for (const LinkFigures& link : link_figures(world))
    list.push_back({{"name", link.name},
                    {"between", {link.between[0], link.between[1]}},
                    {"stiffness_N_per_m", link.stiffness},
                    {"springs", link.springs},
                    {"greatest_force_N", link.greatest_force}});
  return {report_section("links", list)};
}

}  // namespace viscera
