#include "engine/scene/smoke_keys.h"

#include "engine/scene/common_keys.h"
#include "engine/scene/interval.h"

namespace viscera {
namespace {

constexpr double kMostVoxels = 512.0 * 512.0 * 512.0;

KeySpec flow(std::string description) {
  return number("flow_L_per_min", std::move(description)).needed().between(0, 200);
}

ObjectSpec emitter() {
  ObjectSpec spec;
  spec.description = "Where smoke comes from: an instrument that burns, or a place.";
  spec.exactly_one_of = {"instrument", "position_mm"};
  spec.keys = {
      text("instrument", "A hook: smoke where it burns.").known_as("instrument"),
      position("position_mm", "Centre of a ball that gives off smoke steadily."),
      direction_key("Of the jet; its length doesn't matter.", {0, 0, 1}).only_beside("position_mm"),
      number("radius_mm", "Of the ball.")
          .between(0.1, 50)
          .otherwise(1.5)
          .only_beside("position_mm"),
      number("rate_mg_per_s", "Mass of smoke.")
          .needed()
          .between(0, 1000)
          .only_beside("position_mm"),
      number("particles_per_s", "Into which the mass is divided.")
          .between(1, 1000000)
          .otherwise(1000)
          .only_beside("position_mm"),
      number("speed_mm_per_s", "Of the jet.")
          .between(0, 10000)
          .otherwise(120)
          .only_beside("position_mm"),
      number("excess_K", "Temperature over the gas.")
          .between(0, 1000)
          .otherwise(60)
          .only_beside("position_mm"),
  };
  for (KeySpec& key : interval_keys()) spec.keys.push_back(key.only_beside("position_mm"));
  spec.checks = {has_direction("direction"), interval_in_order()};
  return spec;
}

ObjectSpec inlet() {
  ObjectSpec spec;
  spec.description = "Where the insufflator lets gas in.";
  spec.keys = {position("position_mm", "Centre of the opening.").needed(),
               direction_key("Of the jet; its length doesn't matter.", {0, 0, -1}),
               number("radius_mm", "Of the opening.").between(0.1, 50).otherwise(3.0),
               flow("Volume of gas at the cavity's pressure.")};
  for (KeySpec& key : interval_keys()) spec.keys.push_back(std::move(key));
  spec.checks = {has_direction("direction"), interval_in_order()};
  return spec;
}

ObjectSpec leak() {
  return {"Where gas finds its way out, past a trocar: as much as comes in and isn't drawn off.",
          {position("position_mm", "Centre of the opening.").needed(),
           number("radius_mm", "Of the opening.").between(0.1, 50).otherwise(3.0)},
          {},
          {}};
}

ObjectSpec evacuator() {
  ObjectSpec spec;
  spec.description = "Suction that takes gas and smoke away, at a place or an instrument's tip.";
  spec.exactly_one_of = {"instrument", "position_mm"};
  spec.keys = {
      text("instrument", "Draws in at this instrument's tip.").known_as("instrument"),
      position("position_mm", "Centre of the opening."),
      number("radius_mm", "What comes this near is taken away.").between(0.1, 50).otherwise(5.0),
      flow("Volume of gas at the cavity's pressure.")};
  for (KeySpec& key : interval_keys()) spec.keys.push_back(std::move(key));
  spec.checks = {interval_in_order()};
  return spec;
}

}  // namespace

ObjectSpec smoke_keys() {
  ObjectSpec spec;
  spec.description = "A volume that smoke may fill.";
  spec.keys = {
      name_key("Its name in reports and --set; unique among smoke volumes."),
      object("domain", "Smoke that leaves it is mixed into the whole cavity's gas.",
             box("An axis-aligned box of the world."))
          .needed(),
      number("voxel_mm", "Edge of the written volume's voxels.").between(0.1, 50).otherwise(2.0),
      integer("max_particles", "Bound on memory and time.").between(1, 10000000).otherwise(25000),
      number("spacing_mm", "Radius within which particles feel each other.")
          .between(0.1, 50)
          .otherwise(3.0),
      text("laplacian",
           "Of the viscosity: pairwise is consistent and keeps momentum, paper is the published "
           "one.")
          .one_of({"pairwise", "paper"})
          .otherwise("pairwise"),
      number("lifetime_s", "After which a particle is mixed into the whole cavity's gas.")
          .between(0.1, kLongest_s)
          .otherwise(20.0),
      number("particle_mass_ug",
             "Of smoke that one particle of a burn's stands for: fewer are coarser and cost less.")
          .between(0.001, 1000)
          .otherwise(0.1),
      text("look",
           "march: light marched through the smoke's density; sprites: a textured square a "
           "particle.")
          .one_of({"march", "sprites"})
          .otherwise("march"),
      list("emitters", "What fills it; left out: every hook that burns inside its domain.",
           emitter())
          .items(1, 16),
  };
  spec.checks = {{{"domain", "voxel_mm"},
                  [](const Json& values) -> Finding {
                    const Json& box = values["domain"];
                    double voxels = 1.0;
                    for (int i = 0; i < 3; ++i)
                      voxels *= (component(box["max_mm"], i) - component(box["min_mm"], i)) /
                                values["voxel_mm"].get<double>();
                    if (voxels <= kMostVoxels) return {};
                    return {{"voxel_mm", "found " + values["voxel_mm"].dump() +
                                             ", which makes more than 512 x 512 x 512 voxels in "
                                             "the domain, expected fewer: a greater voxel_mm"}};
                  },
                  nullptr},
                 {{"domain", "emitters"},
                  [](const Json& values) -> Finding {
                    const Json& box = values["domain"];
                    return first_outside(values["emitters"], "emitters", box["min_mm"],
                                         box["max_mm"], "the domain");
                  },
                  nullptr}};
  return spec;
}

ObjectSpec gas_keys() {
  return {
      "The gas that holds the cavity open (CO2).",
      {number("pressure_mmHg", "Over atmosphere.").between(0, 50).otherwise(12.0),
       number("temperature_C", "Of the gas.").between(0, 60).otherwise(37.0),
       integer("cells",
               "Cells of the flow along the longest side of its domain; 0: the gas stands still.")
           .between(0, 96)
           .otherwise(32),
       object("domain", "Of the flow; left out: what holds all smoke volumes.",
              box("An axis-aligned box of the world.")),
       number("cavity_L", "Volume of the whole cavity, into which smoke mixes in the end.")
           .between(0.01, 100)
           .otherwise(3.0),
       list("inlets", "Where gas comes in.", inlet()).items(0, 8).otherwise(Json::array()),
       list("leaks", "Where gas may leave.", leak()).items(0, 8).otherwise(Json::array()),
       list("evacuators", "What draws gas and smoke off.", evacuator())
           .items(0, 8)
           .otherwise(Json::array())},
      {},
      {}};
}

ObjectCheck emitters_burn() {
  return {{"smoke", "instruments"},
          [](const Json& scene) -> Finding {
            for (std::size_t s = 0; s < scene["smoke"].size(); ++s) {
              const Json& smoke = scene["smoke"][s];
              if (!smoke.contains("emitters")) continue;
              for (std::size_t e = 0; e < smoke["emitters"].size(); ++e) {
                const Json& emitter = smoke["emitters"][e];
                if (!emitter.contains("instrument")) continue;
                for (const Json& tool : scene["instruments"])
                  if (tool["name"] == emitter["instrument"] && tool["kind"] != "hook")
                    return {{"smoke/" + std::to_string(s) + "/emitters/" + std::to_string(e) +
                                 "/instrument",
                             "found " + emitter["instrument"].dump() + ", which is a " +
                                 tool["kind"].get<std::string>() + ", expected a hook"}};
              }
            }
            return {};
          },
          nullptr};
}

ObjectCheck openings_in_domain() {
  return {{"smoke", "gas"},
          [](const Json& scene) -> Finding {
            const Json& gas = scene["gas"];
            if (gas["cells"] == 0) return {};
            Json low, high;
            if (gas.contains("domain")) {
              low = gas["domain"]["min_mm"];
              high = gas["domain"]["max_mm"];
            }
            for (const Json& smoke : scene["smoke"]) {
              const Json& box = smoke["domain"];
              if (gas.contains("domain")) {
                for (int i = 0; i < 3; ++i)
                  if (component(box["min_mm"], i) < component(low, i) ||
                      component(box["max_mm"], i) > component(high, i))
                    return {{"gas/domain", "found " + low.dump() + " to " + high.dump() +
                                               ", expected a box that holds the smoke volume " +
                                               smoke["name"].dump()}};
                continue;
              }
              if (low.is_null()) {
                low = box["min_mm"];
                high = box["max_mm"];
              }
              for (int i = 0; i < 3; ++i) {
                if (component(box["min_mm"], i) < component(low, i)) low[i] = box["min_mm"][i];
                if (component(box["max_mm"], i) > component(high, i)) high[i] = box["max_mm"][i];
              }
            }
            if (low.is_null()) return {};
            for (const char* list : {"inlets", "leaks", "evacuators"})
              if (Finding found = first_outside(gas[list], std::string("gas/") + list, low, high,
                                                "the gas's domain"))
                return found;
            return {};
          },
          nullptr};
}

}  // namespace viscera
