#include "engine/features/jaws/jaws_keys.h"

#include "engine/scene/to_si.h"

namespace viscera {
namespace {

using Mistake = std::optional<std::pair<std::string, std::string>>;

Mistake one_limit(const Json& instrument) {
  return {{"grip_limit_N", "found " + instrument["grip_limit_N"].dump() +
                               " beside grip_force_N, expected one of the two: drop grip_limit_N, "
                               "the jaws hold 2 jaw_friction grip_force_N"}};
}

KeySpec needs_force(KeySpec key) {
  return key.only_beside("grip_force_N");
}

ObjectSpec turn() {
  return {"How far the handle has turned at one time.",
          {number("time_s", "When; ascending.").needed().between(0, 1e5),
           number("roll_deg", "About the shaft, beyond the instrument's own roll_deg.")
               .needed()
               .between(-3600, 3600)},
          {},
          {}};
}

}  // namespace

const JawsDescription* jaws_of(const InstrumentDescription& instrument) {
  return instrument.extras.find<JawsDescription>();
}

void set_jaws(InstrumentDescription& instrument, const JawsDescription& jaws) {
  instrument.extras.set(jaws);
}

FeatureKeys jaws_keys() {
  FeatureKeys keys;
  keys.instrument.keys = {
      number("grip_force_N",
             "Normal force of each jaw with the handle fully closed; less in proportion up to the "
             "opening .3, where it lets go. What it holds turns with it, is squeezed from two "
             "sides, and slips at 2 jaw_friction times that. In place of grip_limit_N.")
          .between(0.01, 100)
          .only_where("kind", {"grasper"}),
      needs_force(number("jaw_friction",
                         "Coulomb's coefficient of its teeth on tissue. Left out: 0.833, with "
                         "which 3.0 N hold a pull of 5 N.")
                      .between(0.01, 2)),
      needs_force(list("jaw_turns",
                       "How the handle turns the jaws about the shaft; interpolated, monotone and "
                       "smooth. Left out: not at all.",
                       turn())
                      .items(1, 100000)
                      .ascending_by("time_s"))};
  keys.instrument.checks = {{{"grip_force_N", "grip_limit_N"},
                             one_limit,
                             {{"not", {{"required", {"grip_force_N", "grip_limit_N"}}}}}}};
  keys.instrument.read = [](const Json& instrument, Extras& extras) {
    if (!instrument.contains("grip_force_N")) return;
    JawsDescription jaws;
    jaws.force = instrument["grip_force_N"];
    if (instrument.contains("jaw_friction")) jaws.friction = instrument["jaw_friction"];
    if (instrument.contains("jaw_turns"))
      for (const Json& key : instrument["jaw_turns"])
        jaws.turns.push_back({key["time_s"], radians(key["roll_deg"])});
    extras.set(jaws);
  };
  return keys;
}

}  // namespace viscera
