#include "engine/scene/material_keys.h"

#include <fmt/format.h>

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

/// Together: beyond, an instantaneous modulus of more than 20 times the long-term one.
constexpr double kMostRelaxed = 0.95;

ObjectSpec prony_term() {
  return {"One exponential of the series.",
          {number("g", "Share of the instantaneous modulus that relaxes.")
               .needed()
               .between(1e-6, kMostRelaxed),
           number("tau_s", "In this time to 1/e.").needed().between(1e-3, 1e5)},
          {},
          {}};
}

}  // namespace

ObjectSpec material_keys() {
  ObjectSpec spec;
  spec.description =
      "How held tools (`haptic`) feel its tissue beyond small, slow strains. The frame's own "
      "answer, which is drawn, relaxes too where the response is finite; else it stays linear.";
  spec.keys = {
      text("model",
           "Of finite strains under the tool: none (linear), St Venant-Kirchhoff (stvk: linear in "
           "Green's strain; gives way where it is pressed deep), or compressible neo-Hookean.")
          .one_of({"linear", "stvk", "neo_hookean"})
          .otherwise("linear"),
      boolean("relaxes",
              "Whether the force relaxes by the tissue's own Prony series, where it has one.")
          .otherwise(false),
      list("prony",
           "The force relaxes by this Prony series. Young's modulus is the long-term one: at first "
           "the "
           "tissue is 1 / (1 - the sum of g) times as stiff.",
           prony_term())
          .items(1, PronyForce::kMostTerms),
      object("fibres",
             "In place of the tissue's; every response but local knows them. What is finer than "
             "the nodes answers as tissue without.",
             fibres()),
  };
  spec.checks = {
      {{"prony"},
       [](const Json& values) -> Finding {
         double sum = 0.0;
         for (const Json& term : values["prony"]) sum += term["g"].get<double>();
         if (sum <= kMostRelaxed) return {};
         return {{"prony", fmt::format("found shares g of {:g} together, expected at most {:g}",
                                       sum, kMostRelaxed)}};
       },
       nullptr},
      {{"prony", "relaxes"},
       [](const Json& values) -> Finding {
         if (!values["relaxes"].get<bool>()) return {};
         return {{"prony",
                  "found beside \"relaxes\": true, expected one of the two: the tissue's "
                  "series or its own"}};
       },
       nullptr}};
  return spec;
}

MaterialDescription material_of(const Json& values) {
  MaterialDescription material;
  for (const HyperelasticModel model : {HyperelasticModel::kStvk, HyperelasticModel::kNeoHookean})
    if (values["model"] == name_of(model)) material.model = model;
  material.relaxes = values["relaxes"];
  if (values.contains("prony"))
    for (const Json& term : values["prony"])
      material.prony.push_back({term["g"].get<double>(), term["tau_s"].get<double>()});
  if (values.contains("fibres")) material.fibres = fibres_of(values["fibres"]);
  return material;
}

}  // namespace viscera
