#include "engine/features/gravity/gravity_keys.h"

#include <algorithm>

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

ObjectSpec gravity_spec() {
  const ObjectSpec key{
      "How the table lies at one time.",
      {time_key("When; ascending along the table's keys."),
       number("head_up_deg",
              "About the patient's x axis: the head rises over the feet (reverse Trendelenburg); "
              "below 0 it sinks (Trendelenburg).")
           .between(-90, 90)
           .otherwise(0.0),
       number("left_side_down_deg",
              "About the table's long axis: the patient's left side sinks; below 0 the right one.")
           .between(-180, 180)
           .otherwise(0.0)},
      {},
      {}};
  return {
      "Organs have their rest shapes under the gravity in which they were imaged; what gravity "
      "differs from that, as the table tilts, moves them.",
      {number("acceleration_m_per_s2", "Of free fall.").between(0, 100).otherwise(9.81),
       vector("rest_direction",
              "Of gravity while the organs were imaged, in the patient's frame; its length "
              "doesn't matter. On the back it is [0, 0, -1].")
           .between(-1000, 1000)
           .otherwise({0, 0, -1}),
       list("table",
            "Key frames of the table's tilt; between them the angles change smoothly. None: "
            "level.",
            key)
           .items(0, 100000)
           .ascending_by("time_s")
           .otherwise(Json::array())},
      {},
      {has_direction("rest_direction")}};
}

void read_gravity(const Json& scene, Extras& extras) {
  if (!scene.contains("gravity")) return;
  const Json& values = scene["gravity"];
  GravityDescription gravity;
  gravity.acceleration = values["acceleration_m_per_s2"];
  gravity.rest_direction = direction_of(values["rest_direction"]);
  for (const Json& key : values["table"])
    gravity.table.push_back(
        {key["time_s"], radians(key["head_up_deg"]), radians(key["left_side_down_deg"])});
  extras.set(std::move(gravity));
}

}  // namespace

bool GravityDescription::changes() const {
  return acceleration > 0.0 && (rest_direction != -Vec3::UnitZ() ||
                                std::any_of(table.begin(), table.end(), [](const TableKey& key) {
                                  return key.head_up != 0.0 || key.left_down != 0.0;
                                }));
}

const GravityDescription* gravity_of(const SceneDescription& scene) {
  return scene.extras.find<GravityDescription>();
}

bool hung_in_image(const OrganDescription& organ) {
  return organ.extras.find<HungInImage>();
}

bool sags(const OrganDescription& organ) {
  return !organ.extras.find<NeverSags>();
}

FeatureKeys gravity_keys() {
  FeatureKeys keys;
  keys.scene.keys = {object("gravity",
                            "How gravity changes as the table tilts; without it, organs weigh "
                            "nothing.",
                            gravity_spec())};
  keys.scene.read = read_gravity;
  keys.organ.keys = {
      boolean(
          "sags",
          "Whether gravity moves it where the scene has gravity that changes; then it is prepared "
          "though nothing touches it. Scenery never sags.")
          .otherwise(true),
      boolean("hung_in_image",
              "Whether its holds alone bore its weight while it was imaged, so that it was "
              "stretched there: preparation then finds its shape without weight. false: what it "
              "lay among bore it from all sides, as a fluid does, which strains nothing. Counts at "
              "finite strain, where the scene has gravity.")
          .otherwise(false)};
  keys.organ.checks = {
      {{"hung_in_image", "free"},
       [](const Json& organ) -> std::optional<std::pair<std::string, std::string>> {
         if (!organ["hung_in_image"].get<bool>() || !organ["free"].get<bool>()) return {};
         return {{"hung_in_image", "found true with free, expected false: nothing held it"}};
       },
       {}}};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (organ["hung_in_image"].get<bool>()) extras.set(HungInImage());
    if (!organ["sags"].get<bool>()) extras.set(NeverSags());
  };
  return keys;
}

}  // namespace viscera
