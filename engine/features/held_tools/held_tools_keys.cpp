#include "engine/features/held_tools/held_tools_keys.h"

#include <algorithm>

#include "engine/scene/to_si.h"

namespace viscera {
namespace {

ObjectSpec hive_spec() {
  return {"The nodes that travel with the tip and answer it at 1 kHz (LPAFF).",
          {number("radius_mm",
                  "Of the influence region on the surface. Left out: from the tip's size, so large "
                  "that a larger one would change the force by less than 5 %.")
               .between(0.1, 200),
           integer("nodes", "How many. Left out: 120.").between(12, 1000),
           text("periphery",
                "What moves its edge: the body's precomputed field (coupled), the half-space's "
                "(boussinesq), or nothing, as published (fixed). Left out: coupled where the organ "
                "has a precomputed response, else boussinesq.")
               .one_of({"coupled", "boussinesq", "fixed"}),
           text("formulation", "Of its equations; paper: the published ones.")
               .one_of({"default", "paper"})
               .otherwise("default")},
          {},
          {}};
}

ObjectSpec haptic_spec() {
  return {
      "Makes the instrument a held tool: a device moves its tip and feels its force, 1,000 times "
      "a second; `path` is where the modelled hand wants to go.",
      {text("device",
            "A simulated PHANToM Premium 1.0A in a modelled hand; a recording of a device; or one "
            "behind the network (OpenIGTLink).")
           .one_of({"simulated", "recorded", "network"})
           .otherwise("simulated"),
       neighbour_key("recording",
                     "Its file, in the scene's folder: CSV or HDF5, as `viscera haptics --record` "
                     "writes it.")
           .needed()
           .only_where("device", {"recorded"}),
       integer("port", "TCP port on which the device's program connects.")
           .between(1, 65535)
           .otherwise(18944)
           .only_where("device", {"network"}),
       text("grip", "How firmly the modelled hand holds the device.")
           .one_of({"loose", "medium", "firm"})
           .otherwise("medium")
           .only_where("device", {"simulated"}),
       number("coupling_N_per_m",
              "Stiffness of the virtual coupling between device and tool. Left out: what is "
              "stable on the device for any grip.")
           .between(1, 1e5),
       object("hive", "How tissue answers.", hive_spec()).otherwise(Json::object())},
      {},
      {}};
}

HiveDescription read_hive(const Json& values) {
  using Periphery = HiveDescription::Periphery;
  HiveDescription hive;
  if (values.contains("radius_mm")) hive.radius = from_milli(values["radius_mm"]);
  if (values.contains("nodes")) hive.nodes = values["nodes"];
  if (values.contains("periphery"))
    hive.periphery = values["periphery"] == "coupled"      ? Periphery::kCoupled
                     : values["periphery"] == "boussinesq" ? Periphery::kBoussinesq
                                                           : Periphery::kFixed;
  hive.paper = values["formulation"] == "paper";
  return hive;
}

HapticDescription read_haptic(const Json& values) {
  using Device = HapticDescription::Device;
  using Grip = HapticDescription::Grip;
  HapticDescription haptic;
  haptic.device = values["device"] == "simulated"  ? Device::kSimulated
                  : values["device"] == "recorded" ? Device::kRecorded
                                                   : Device::kNetwork;
  if (values.contains("recording")) haptic.recording = values["recording"].get<std::string>();
  if (values.contains("port")) haptic.port = values["port"];
  if (values.contains("grip"))
    haptic.grip = values["grip"] == "loose"  ? Grip::kLoose
                  : values["grip"] == "firm" ? Grip::kFirm
                                             : Grip::kMedium;
  if (values.contains("coupling_N_per_m")) haptic.coupling_stiffness = values["coupling_N_per_m"];
  haptic.hive = read_hive(values["hive"]);
  return haptic;
}

}  // namespace

const HapticDescription* haptic_of(const InstrumentDescription& instrument) {
  return instrument.extras.find<HapticDescription>();
}

bool holds_tools(const SceneDescription& scene) {
  return std::any_of(scene.instruments.begin(), scene.instruments.end(), haptic_of);
}

FeatureKeys held_tools_keys() {
  FeatureKeys keys;
  keys.instrument.keys = {
      object("haptic", "Makes it a held tool; without it, the path moves the tip.", haptic_spec())};
  keys.instrument.read = [](const Json& instrument, Extras& extras) {
    if (instrument.contains("haptic")) extras.set(read_haptic(instrument["haptic"]));
  };
  return keys;
}

}  // namespace viscera
