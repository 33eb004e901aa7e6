#include "engine/features/clips/clips_keys.h"

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

constexpr double kPascals = 1e3;  // a kilopascal has

DuctDescription duct_of(const Json& values) {
  DuctDescription duct;
  duct.name = values["name"];
  for (const Json& one : values["through"]) duct.path.push_back(from_milli_vector(one["point_mm"]));
  duct.pressure = kPascals * values["pressure_kPa"].get<double>();
  const std::string fed = values["fed_from"];
  duct.fed = fed == "start" ? DuctDescription::Fed::kStart
             : fed == "end" ? DuctDescription::Fed::kEnd
                            : DuctDescription::Fed::kBoth;
  return duct;
}

KeySpec of_applier(KeySpec key, Json fallback) {
  return key.otherwise(std::move(fallback)).only_where("kind", {"clip_applier"});
}

}  // namespace

const ClipsDescription* clips_of(const InstrumentDescription& instrument) {
  return instrument.extras.find<ClipsDescription>();
}

std::span<const DuctDescription> ducts_of(const OrganDescription& organ) {
  const DuctsDescription* ducts = organ.extras.find<DuctsDescription>();
  return ducts ? std::span<const DuctDescription>(ducts->ducts)
               : std::span<const DuctDescription>();
}

FeatureKeys clips_keys() {
  FeatureKeys keys;
  keys.instrument.keys = {
      of_applier(integer("clips",
                         "How many it is loaded with: it leaves one each time that it "
                         "closes on tissue.")
                     .between(1, 20),
                 1),
      of_applier(number("clip_mm", "Length of a clip's bars, from the tip back along the shaft.")
                     .between(3, 30),
                 9.0),
      of_applier(number("clip_bar_mm", "Width of its bars.").between(0.3, 5), 1.0),
      of_applier(number("clip_opening_mm", "Between its bars before it closes.").between(1, 30),
                 9.0),
      of_applier(number("clip_gap_mm",
                        "Between its bars once it is shut. Tissue is squeezed to a third of its "
                        "thickness at most.")
                     .between(0.05, 5),
                 0.5),
      of_applier(
          number("clip_holds_kPa",
                 "Pressure in a duct that it holds, once it is shut. Left out: 40, 300 mmHg.")
              .between(0.1, 1000),
          40.0)};
  keys.instrument.read = [](const Json& instrument, Extras& extras) {
    if (!instrument.contains("clips")) return;
    extras.set(ClipsDescription{instrument["clips"], from_milli(instrument["clip_mm"]),
                                from_milli(instrument["clip_bar_mm"]),
                                from_milli(instrument["clip_opening_mm"]),
                                from_milli(instrument["clip_gap_mm"]),
                                kPascals * instrument["clip_holds_kPa"].get<double>()});
  };
  const ObjectSpec duct{
      "A duct or a vessel: a line through the organ, which is solid here.",
      {name_key("Its name in report.json; unique among the organ's."),
       list("through", "Its line, straight between these points.",
            {"A point of it.",
             {position("point_mm", "Where, in the organ's own frame.").needed()},
             {},
             {}})
           .needed()
           .items(2, 1000),
       number("pressure_kPa", "In it, over the pressure about the organ.")
           .needed()
           .between(0.01, 100),
       text("fed_from", "The ends of its line from which it would flow, were it cut.")
           .one_of({"start", "end", "both"})
           .otherwise("start")},
      {},
      {}};
  keys.organ.keys = {list("ducts",
                          "Ducts and vessels in it. report.json says which of them blades or heat "
                          "have cut, and whether clips close them (clips, ducts).",
                          duct)
                         .items(1, 100)
                         .unique_by("name")
                         .only_beside("cuttable")};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (!organ.contains("ducts")) return;
    DuctsDescription ducts;
    for (const Json& one : organ["ducts"]) ducts.ducts.push_back(duct_of(one));
    extras.set(std::move(ducts));
  };
  return keys;
}

}  // namespace viscera
