#include "engine/features/gas/gas_keys.h"

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"
#include "kernels/heat/tissue_thermal.h"

namespace viscera {
namespace {

constexpr double kLitrePerMinute = 1e-3 / 60.0;  // [m3/s]

ObjectSpec inlet() {
  ObjectSpec spec;
  spec.description =
      "Where the insufflator lets gas in: as much as keeps the set pressure, up to its limit.";
  spec.keys = {position("position_mm", "Centre of the opening.").needed(),
               direction_key("Of the jet; its length doesn't matter.", {0, 0, -1}),
               number("radius_mm", "Of the opening.").between(0.1, 50).otherwise(3.0),
               number("limit_L_per_min", "The most that it lets in, at the cavity's pressure.")
                   .needed()
                   .between(0, 200)};
  for (KeySpec& key : interval_keys()) spec.keys.push_back(std::move(key));
  spec.checks = {has_direction("direction"), interval_in_order()};
  spec.replaced = {{"flow_L_per_min",
                    "limit_L_per_min: the insufflator keeps pressure_mmHg, and lets in no more "
                    "than that"}};
  return spec;
}

ObjectSpec leak() {
  return {
      "A sharp-edged hole past a trocar, through which the cavity's pressure drives gas out; "
      "below atmosphere's, air in.",
      {position("position_mm", "Centre of the opening.").needed(),
       number("area_mm2", "Of the opening: 1.3 lets out 2 L/min at 12 mmHg.")
           .between(0, 1000)
           .otherwise(1.3)},
      {},
      {},
      {{"radius_mm",
        "area_mm2, of the hole: gas leaves by the cavity's pressure, 1.5 L/min through each "
        "mm2 at 12 mmHg"}}};
}

ObjectSpec evacuator() {
  ObjectSpec spec;
  spec.description = "Suction that takes gas and smoke away, at a place or an instrument's tip.";
  spec.exactly_one_of = {"instrument", "position_mm"};
  spec.keys = {
      text("instrument", "Draws in at this instrument's tip.").known_as("instrument"),
      position("position_mm", "Centre of the opening."),
      number("radius_mm", "What comes this near is taken away.").between(0.1, 50).otherwise(5.0),
      number("flow_L_per_min",
             "Volume of gas at the cavity's pressure, while the wall isn't drawn onto it.")
          .needed()
          .between(0, 200)};
  for (KeySpec& key : interval_keys()) spec.keys.push_back(std::move(key));
  spec.checks = {interval_in_order()};
  return spec;
}

ObjectSpec gas_spec() {
  return {
      "The gas that holds the cavity open (CO2).",
      {number("pressure_mmHg", "Over atmosphere: at first, and what the insufflator keeps.")
           .between(0, 50)
           .otherwise(12.0),
       number("temperature_C", "Of the gas.").between(0, 60).otherwise(37.0),
       number("humidity",
              "Relative, of the resting gas: 0 as it comes from the bottle, nearly 1 where it has "
              "stood on wet organs. In humid gas condensed steam lasts.")
           .between(0, 1)
           .otherwise(0.0),
       integer("cells",
               "Cells of the flow along the longest side of its domain; 0: the gas stands still.")
           .between(0, 96)
           .otherwise(32),
       object("domain", "Of the flow; left out: what holds all smoke volumes.",
              box("An axis-aligned box of the world.")),
       number("cavity_L",
              "Volume of the whole cavity at that pressure, into which smoke mixes in the end.")
           .between(0.01, 100)
           .otherwise(3.0),
       number("compliance_mL_per_mmHg",
              "Of the cavity's wall: by how much it yields to pressure. 106 is the first 1.27 L "
              "at 12 mmHg of a study of pneumoperitoneum [Song2006].")
           .between(1, 10000)
           .otherwise(106.0),
       list("inlets", "Where gas comes in.", inlet()).items(0, 8).otherwise(Json::array()),
       list("leaks", "Where gas may leave.", leak()).items(0, 8).otherwise(Json::array()),
       list("evacuators", "What draws gas and smoke off.", evacuator())
           .items(0, 8)
           .otherwise(Json::array())},
      {},
      {}};
}

// Where gas comes and goes lies in the flow's domain.
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

GasDescription read_gas(const Json& values) {
  GasDescription gas;
  gas.pressure = values["pressure_mmHg"].get<double>() * kPascalPerMillimetreOfMercury;
  gas.temperature = values["temperature_C"].get<double>() + kZeroCelsius;
  gas.humidity = values["humidity"];
  gas.cells = values["cells"];
  if (values.contains("domain")) gas.domain = box_of(values["domain"]);
  gas.cavity = from_milli(values["cavity_L"]);  // a litre is a thousandth of a cubic metre
  constexpr double kMillilitre = 1e-6, kSquareMillimetre = 1e-6;  // [m3], [m2]
  gas.compliance =
      values["compliance_mL_per_mmHg"].get<double>() * kMillilitre / kPascalPerMillimetreOfMercury;
  for (const Json& inlet : values["inlets"])
    gas.inlets.push_back({from_milli_vector(inlet["position_mm"]), direction_of(inlet["direction"]),
                          from_milli(inlet["radius_mm"]),
                          inlet["limit_L_per_min"].get<double>() * kLitrePerMinute,
                          interval_of(inlet)});
  for (const Json& leak : values["leaks"])
    gas.leaks.push_back({from_milli_vector(leak["position_mm"]),
                         leak["area_mm2"].get<double>() * kSquareMillimetre});
  for (const Json& suction : values["evacuators"]) {
    EvacuatorDescription evacuator;
    if (suction.contains("instrument"))
      evacuator.instrument = suction["instrument"];
    else
      evacuator.position = from_milli_vector(suction["position_mm"]);
    evacuator.radius = from_milli(suction["radius_mm"]);
    evacuator.flow = suction["flow_L_per_min"].get<double>() * kLitrePerMinute;
    evacuator.when = interval_of(suction);
    gas.evacuators.push_back(std::move(evacuator));
  }
  return gas;
}

}  // namespace

GasMixture GasDescription::mixture() const {
  GasMixture mixture;
  mixture.pressure = gas::kAtmosphere + pressure;
  mixture.temperature = temperature;
  mixture.humidity = humidity;
  return mixture;
}

CavityParameters GasDescription::cavity_parameters() const {
  return {
      .mixture = mixture(), .set_pressure = pressure, .volume = cavity, .compliance = compliance};
}

const GasDescription& gas_of(const SceneDescription& scene) {
  static const GasDescription plain;
  const auto* gas = scene.extras.find<GasDescription>();
  return gas ? *gas : plain;
}

FeatureKeys gas_keys() {
  FeatureKeys keys;
  keys.scene.keys = {object("gas", "The gas that holds the cavity open (CO2).", gas_spec())
                         .otherwise(Json::object())};
  keys.scene.checks = {openings_in_domain()};
  keys.scene.read = [](const Json& scene, Extras& extras) { extras.set(read_gas(scene["gas"])); };
  return keys;
}

}  // namespace viscera
