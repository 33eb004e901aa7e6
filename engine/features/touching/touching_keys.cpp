#include "engine/features/touching/touching_keys.h"

#include "engine/features/shafts/shafts_keys.h"

namespace viscera {
namespace {

ObjectSpec contact_spec() {
  ObjectSpec spec;
  spec.description = "How bodies of the scene meet each other.";
  spec.keys = {
      boolean("organs",
              "Organs press each other where their surfaces meet, deformable ones against all; "
              "what overlaps at rest is kept, up to 3 mm. false: they pass through each other.")
          .otherwise(false),
      boolean("folds",
              "Deformable organs press themselves where loops of them meet or folds close. false: "
              "they pass through themselves.")
          .otherwise(false),
      number("organ_friction",
             "Coefficient of Coulomb friction between organs, and of folds. 0: their wet surfaces "
             "slide freely.")
          .between(0, 2)
          .otherwise(0.0),
      number("organ_pitch",
             "Distance of the patches by which organs meet, over that of their nodes. The "
             "fewer of them lie where organs touch, the smaller the force that is found; more of "
             "them make frames longer (`viscera bench contact`).")
          .between(0.1, 4)
          .otherwise(0.5),
  };
  for (KeySpec& key : shaft_keys_of_contact()) spec.keys.push_back(std::move(key));
  return spec;
}

void read_contact(const Json& scene, Extras& extras) {
  if (!scene.contains("contact")) return;
  const Json& values = scene["contact"];
  extras.set(TouchingDescription{.organs = values["organs"],
                                 .folds = values["folds"],
                                 .friction = values["organ_friction"],
                                 .pitch = values["organ_pitch"]});
}

}  // namespace

const TouchingDescription& touching_of(const SceneDescription& scene) {
  static const TouchingDescription none;
  const auto* said = scene.extras.find<TouchingDescription>();
  return said ? *said : none;
}

FeatureKeys touching_keys() {
  FeatureKeys keys;
  keys.scene.keys = {object("contact", "What touches what.", contact_spec())};
  keys.scene.read = read_contact;
  return keys;
}

}  // namespace viscera
