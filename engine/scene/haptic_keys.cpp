#include "engine/scene/haptic_keys.h"

#include "engine/scene/common_keys.h"

namespace viscera {
namespace {

ObjectSpec hive() {
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

}  // namespace

ObjectSpec haptic_keys() {
  return {
      "Makes the instrument a held tool: a device moves its tip and feels its force, 1,000 times "
      "a second; `path` is where the modelled hand wants to go.",
      {text("device",
            "A simulated PHANToM Premium 1.0A in a modelled hand; a recording of a device; or one "
            "behind the network (OpenIGTLink).")
           .one_of({"simulated", "recorded", "network"})
           .otherwise("simulated"),
       text("recording",
            "Its file, sought from the scene's folder: CSV or HDF5, as `viscera haptics --record` "
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
       object("hive", "How tissue answers.", hive()).otherwise(Json::object())},
      {},
      {}};
}

}  // namespace viscera
