#include "engine/features/cautery/cautery_keys.h"

#include <algorithm>

#include "engine/scene/to_si.h"

namespace viscera {
namespace {

ObjectSpec heat_spec() {
  return {"Where nothing is warm, nothing is kept or computed.",
          {number("voxel_mm", "Edge of the voxels in which heat spreads.")
               .between(0.001, 2)
               .otherwise(0.5),
           text("lesion_of",
                "A hook: depth and width of the lesion under the place where it first burns go to "
                "lesion.csv and lesion.svg.")
               .known_as("instrument"),
           object("published", "What is known of burns like it, as far as it is, for lesion.svg.",
                  {"Of tissue that has coagulated.",
                   {number("least_depth_mm", "Under the electrode.").between(0, 100),
                    number("most_depth_mm", "Under the electrode.").between(0, 100),
                    number("least_width_mm", "At the surface.").between(0, 100),
                    number("most_width_mm", "At the surface.").between(0, 100),
                    text("source", "And whether it was read there or recalled.").needed()},
                   {},
                   {}})
               .only_beside("lesion_of")},
          {},
          {}};
}

void read_heat(const Json& scene, Extras& extras) {
  const Json& values = scene["heat"];
  HeatDescription heat;
  heat.voxel = from_milli(values["voxel_mm"]);
  if (values.contains("lesion_of")) heat.lesion_of = values["lesion_of"];
  if (values.contains("published")) {
    const Json& published = values["published"];
    const auto size = [&](const char* key) -> std::optional<double> {
      if (!published.contains(key)) return {};
      return from_milli(published[key]);
    };
    heat.published = {size("least_depth_mm"), size("most_depth_mm"), size("least_width_mm"),
                      size("most_width_mm"), published["source"]};
  }
  extras.set(std::move(heat));
}

void read_mode(const Json& instrument, Extras& extras) {
  if (!instrument.contains("mode")) return;
  const Json& name = instrument["mode"];
  extras.set(name == "cut"         ? CurrentMode::kCut
             : name == "blend"     ? CurrentMode::kBlend
             : name == "coagulate" ? CurrentMode::kCoagulate
                                   : CurrentMode::kFulgurate);
}

}  // namespace

const HeatDescription& heat_of(const SceneDescription& scene) {
  static const HeatDescription plain;
  const auto* heat = scene.extras.find<HeatDescription>();
  return heat ? *heat : plain;
}

bool is_spared(const OrganDescription& organ) {
  return organ.extras.find<Spared>() != nullptr;
}

CurrentMode mode_of(const InstrumentDescription& hook) {
  const auto* mode = hook.extras.find<CurrentMode>();
  return mode ? *mode : CurrentMode::kBlend;
}

const BipolarDescription* bipolar_of(const InstrumentDescription& tool) {
  return tool.extras.find<BipolarDescription>();
}

bool carries_current(const InstrumentDescription& tool) {
  return (conducts(tool.kind) || bipolar_of(tool)) &&
         std::any_of(tool.path.begin(), tool.path.end(),
                     [](const InstrumentKey& key) { return key.power > 0.0; });
}

FeatureKeys cautery_keys() {
  FeatureKeys keys;
  keys.scene.keys = {object("heat", "How heat is followed in organs that hooks burn.", heat_spec())
                         .otherwise(Json::object())};
  keys.scene.read = read_heat;
  keys.organ.keys = {
      boolean("spared", "Burning it is a mistake of the trainee's, which report.json counts.")
          .otherwise(false)};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (organ["spared"].get<bool>()) extras.set(Spared());
  };
  keys.instrument.keys = {
      text("mode",
           "Of the generator of a hook, a spatula or scissors: cut, a steady wave of low voltage; "
           "blend; coagulate, short waves "
           "for a touching tip; fulgurate, short waves of high voltage that spark over a gap.")
          .one_of({"cut", "blend", "coagulate", "fulgurate"})
          .otherwise("blend")
          .only_where("kind", {"hook", "spatula", "scissors"}),
      object(
          "bipolar",
          "Jaws that seal: power_W of the path goes from jaw to jaw through what they hold, until "
          "its impedance lies a quarter above its least at the same gap. The next cycle begins "
          "after "
          "power_W 0, or as they hold something else.",
          {"What a seal bears.",
           {number("holds_kPa",
                   "Pressure that a seal keeps in a duct (ducts), once nine tenths of it have "
                   "coagulated. That of a vessel sealer's is some 48, thrice that of an artery.")
                .between(0.1, 200)
                .otherwise(48.0),
            number("blade_mm",
                   "A knife between the jaws: from so far behind the tip it runs to the tip while "
                   "they are closed and the path says blade, and parts what lies between them. "
                   "Left out: there is none.")
                .between(1, 40)},
           {},
           {}})
          .only_beside("grip_force_N")};
  keys.instrument.read = [](const Json& instrument, Extras& extras) {
    read_mode(instrument, extras);
    if (!instrument.contains("bipolar")) return;
    const Json& jaws = instrument["bipolar"];
    BipolarDescription bipolar{.holds = 1e3 * jaws["holds_kPa"].get<double>()};
    if (jaws.contains("blade_mm")) bipolar.blade = from_milli(jaws["blade_mm"]);
    extras.set(bipolar);
  };
  return keys;
}

}  // namespace viscera
