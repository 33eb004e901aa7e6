#include "engine/features/links/links_keys.h"

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

ObjectSpec link_spec() {
  ObjectSpec spec;
  spec.description = "Springs that tie two organs: a ligament, the gallbladder's bed.";
  spec.keys = {
      name_key("Its name in reports and --set; unique among links."),
      texts("between",
            "The two organs that it ties; in the place of one, \"ground\": what never moves.", 2)
          .known_as("organ")
          .needed(),
      object("region", "Holds the surface on which its springs end, of both organs.",
             part_of_world())
          .needed(),
      number("stiffness_N_per_m",
             "Of all its springs together, in every direction; without tension where both organs "
             "stand undeformed at their poses. 0: nothing is tied.")
          .needed()
          .between(0, 1e9),
  };
  spec.checks = {between_two()};
  return spec;
}

// Both ends on what never deforms: nothing would come of it.
Finding links_tie_tissue(const Json& scene) {
  for (std::size_t i = 0; i < scene["organs"].size() && !scene["links"].empty(); ++i)
    if (scene["organs"][i]["name"] == LinkDescription::kGround)
      return {{"organs/" + std::to_string(i) + "/name",
               "found \"ground\", expected another name: links mean by it what never moves"}};
  return first_between_scenery(scene, "links");
}

void read_links(const Json& scene, Extras& extras) {
  LinkDescriptions links;
  for (const Json& values : scene["links"]) {
    LinkDescription link;
    link.name = values["name"];
    link.between = {values["between"][0], values["between"][1]};
    link.region = region_of(values["region"]);
    link.stiffness = values["stiffness_N_per_m"];
    links.push_back(std::move(link));
  }
  extras.set(std::move(links));
}

}  // namespace

std::span<const LinkDescription> links_of(const SceneDescription& scene) {
  const auto* links = scene.extras.find<LinkDescriptions>();
  return links ? std::span<const LinkDescription>(*links) : std::span<const LinkDescription>();
}

FeatureKeys links_keys() {
  FeatureKeys keys;
  keys.scene.keys = {list("links",
                          "What ties organs to each other: ligaments, the gallbladder's bed.",
                          link_spec())
                         .items(0, 200)
                         .unique_by("name")
                         .otherwise(Json::array())};
  keys.scene.checks = {{{"organs", "links"}, links_tie_tissue, nullptr}};
  keys.scene.read = read_links;
  keys.words["organ"] = {LinkDescription::kGround};
  return keys;
}

}  // namespace viscera
