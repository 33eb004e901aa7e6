#include "engine/features/beds/beds_keys.h"

#include <fmt/format.h>

#include "engine/features/links/links_keys.h"
#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"
#include "kernels/heat/tissue_thermal.h"

namespace viscera {
namespace {

CohesiveLaw law_of(const Json& bed) {
  return {1e3 * bed["strength_kPa"].get<double>(), 1e6 * bed["stiffness_kPa_per_mm"].get<double>(),
          bed["toughness_J_per_m2"].get<double>()};
}

CohesiveLaw film_of(const Json& film) {
  return {film["strength_N_per_m"].get<double>(),
          1e3 * film["stiffness_N_per_m_per_mm"].get<double>(),
          film["toughness_J_per_m"].get<double>()};
}

/// What is wrong with a law, by the keys of its toughness and of the other two.
Finding finding_on(const CohesiveLaw& law, const char* toughness, const char* others) {
  if (law.is_sound()) return {};
  return {
      {toughness,
       fmt::format("found {:g}, expected more than {:g}: what it takes up before it softens ({})",
                   law.toughness, 0.5 * law.strength * law.first(), others)}};
}

Finding law_falls(const Json& bed) {
  return finding_on(law_of(bed), "toughness_J_per_m2", "strength_kPa, stiffness_kPa_per_mm");
}

Finding film_falls(const Json& film) {
  return finding_on(film_of(film), "toughness_J_per_m",
                    "strength_N_per_m, stiffness_N_per_m_per_mm");
}

ObjectSpec film_spec() {
  ObjectSpec spec;
  spec.description =
      "A film of peritoneum over the bed's edge, from one organ to the other. It gives way along "
      "the edge, by force or by heat, with the bonds under it. The edge is where the bed ends, be "
      "it by its region. Left out: there is none.";
  spec.keys = {
      number("strength_N_per_m",
             "Greatest pull along a length of edge. The fallback is chosen: a film of .2 mm that "
             "stands .1 MPa.")
          .between(0.01, 10000)
          .otherwise(20.0),
      number("stiffness_N_per_m_per_mm", "Pull per opening while it is whole. Chosen.")
          .between(0.01, 1e6)
          .otherwise(20.0),
      number("toughness_J_per_m", "Work that parts a length of edge. Chosen: 3 mm of opening.")
          .between(1e-6, 1000)
          .otherwise(0.03)};
  spec.checks = {
      {{"strength_N_per_m", "stiffness_N_per_m_per_mm", "toughness_J_per_m"}, film_falls, nullptr}};
  return spec;
}

Finding lies_between_surfaces(const Json& bed) {
  for (std::size_t side = 0; side < 2; ++side)
    if (bed["between"][side] == LinkDescription::kGround)
      return {{"between/" + std::to_string(side),
               "found \"ground\", expected an organ: a bed lies between two surfaces"}};
  return {};
}

ObjectSpec bed_spec() {
  ObjectSpec spec;
  spec.description =
      "A layer of connective tissue that holds two organs together until force or heat parts it: "
      "the gallbladder's bed.";
  spec.keys = {
      name_key("Its name in reports and --set; unique among beds."),
      texts("between", "The two organs that it holds together.", 2).known_as("organ").needed(),
      object("region", "Holds the bed.", part_of_world()).needed(),
      number("within_mm",
             "Surfaces are bonded where they are no farther than this from each other at rest.")
          .between(0.1, 10)
          .otherwise(2.0),
      number("bond_mm", "Distance of its bonds.").between(0.3, 3).otherwise(1.0),
      number("strength_kPa",
             "Greatest traction that it stands. The fallback is chosen: nobody has "
             "measured a gallbladder's bed.")
          .between(0.1, 10000)
          .otherwise(6.0),
      number("stiffness_kPa_per_mm",
             "Traction per opening while it is whole. The fallback is chosen: loose tissue of "
             "7 kPa, a millimetre thick.")
          .between(0.1, 1e6)
          .otherwise(7.0),
      number("toughness_J_per_m2", "Work that parts it. The fallback is assumed, between 5 and 20.")
          .between(0.01, 10000)
          .otherwise(10.0),
      number("parts_at_C",
             "A bond parts when tissue at one of its ends gets so hot, or a hook with current "
             "touches it. The fallback is where its water boils.")
          .between(45, 400)
          .otherwise(100.0),
      object("film", "A film of peritoneum over its edge.", film_spec())};
  spec.checks = {
      between_two(),
      {{"between"}, lies_between_surfaces, nullptr},
      {{"strength_kPa", "stiffness_kPa_per_mm", "toughness_J_per_m2"}, law_falls, nullptr}};
  return spec;
}

/// At least one yields; and what a bed lets go of is met by contact.
Finding beds_hold_tissue(const Json& scene) {
  if (scene["beds"].empty()) return {};
  if (!scene.contains("contact") || !scene["contact"]["organs"].get<bool>())
    return {{"beds",
             "found beds where organs don't touch, expected contact/organs to be true: what a bed "
             "lets go of would pass through what it lay on"}};
  return first_between_scenery(scene, "beds");
}

void read_beds(const Json& scene, Extras& extras) {
  BedDescriptions beds;
  for (const Json& values : scene["beds"]) {
    BedDescription bed;
    bed.name = values["name"];
    bed.between = {values["between"][0], values["between"][1]};
    bed.region = region_of(values["region"]);
    bed.within = from_milli(values["within_mm"]);
    bed.pitch = from_milli(values["bond_mm"]);
    bed.law = law_of(values);
    if (values.contains("film")) bed.film = film_of(values["film"]);
    bed.parts_at = kZeroCelsius + values["parts_at_C"].get<double>();
    beds.push_back(std::move(bed));
  }
  extras.set(std::move(beds));
}

}  // namespace

std::span<const BedDescription> beds_of(const SceneDescription& scene) {
  const auto* beds = scene.extras.find<BedDescriptions>();
  return beds ? std::span<const BedDescription>(*beds) : std::span<const BedDescription>();
}

FeatureKeys beds_keys() {
  FeatureKeys keys;
  keys.scene.keys = {
      list("beds", "Layers that hold organs together until force or heat parts them.", bed_spec())
          .items(0, 20)
          .unique_by("name")
          .otherwise(Json::array())};
  keys.scene.checks = {{{"organs", "beds", "contact"}, beds_hold_tissue, nullptr}};
  keys.scene.read = read_beds;
  return keys;
}

}  // namespace viscera
