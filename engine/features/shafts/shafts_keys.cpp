#include "engine/features/shafts/shafts_keys.h"

#include "engine/scene/common_keys.h"

namespace viscera {

std::vector<KeySpec> shaft_keys_of_contact() {
  return {
      boolean("shafts",
              "The shafts of instruments, from their working ends to their trocars, and the "
              "endoscope's barrel press deformable organs, and the hand feels it by the lever "
              "about the trocar. false: they pass through organs.")
          .otherwise(false),
      number("endoscope_radius_mm",
             "Of the endoscope's barrel, behind the lens, where `shafts` or `tools` are to touch. "
             "0: the endoscope touches nothing.")
          .between(0, 10)
          .otherwise(5.0),
      boolean("tools",
              "Instruments, from their tips to their trocars, press each other and the endoscope's "
              "barrel, as tubes that bend, and the hand feels it. false: they pass through each "
              "other.")
          .otherwise(false),
  };
}

const ShaftsDescription& shafts_of(const SceneDescription& scene) {
  static const ShaftsDescription none;
  const auto* said = scene.extras.find<ShaftsDescription>();
  return said ? *said : none;
}

FeatureKeys shafts_keys() {
  FeatureKeys keys;
  keys.scene.read = [](const Json& scene, Extras& extras) {
    if (!scene.contains("contact")) return;
    const Json& values = scene["contact"];
    extras.set(ShaftsDescription{
        values["shafts"], 1e-3 * values["endoscope_radius_mm"].get<double>(), values["tools"]});
  };
  return keys;
}

}  // namespace viscera
