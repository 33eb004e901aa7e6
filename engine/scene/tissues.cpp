#include "engine/scene/tissues.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/scene/common_keys.h"
#include "engine/scene/quantities.h"
#include "engine/scene/scene.h"
#include "engine/scene/to_si.h"
#include "engine/scene/validate.h"

namespace viscera {
namespace {

KeySpec colour(std::string name, std::string description) {
  return vector(std::move(name), std::move(description)).needed().between(0, 1);
}

KeySpec share(std::string name, std::string description) {
  return number(std::move(name), std::move(description)).needed().between(0, 1);
}

KeySpec size(std::string name, std::string description) {
  return number(std::move(name), std::move(description)).needed().between(0.001, 1000);
}

constexpr std::array kPatterns = {
    std::pair("capsule", TissueLook::Pattern::kCapsule),
    std::pair("lobules", TissueLook::Pattern::kLobules),
    std::pair("fibres", TissueLook::Pattern::kFibres),
};

std::vector<Json> pattern_names() {
  std::vector<Json> names;
  for (const auto& [name, pattern] : kPatterns) names.emplace_back(name);
  return names;
}

ObjectSpec look() {
  return {
      "How the renderer paints it.",
      {text("pattern",
            "capsule: a smooth skin over mottled flesh; lobules: rounded, furrows between; "
            "fibres: bundles along the organ's x axis.")
           .needed()
           .one_of(pattern_names()),
       text("colour_space", "Of the colours below.").needed().one_of({"linear", "srgb"}),
       colour("colour", "Base."),
       colour("mottle_colour", "Of the spots, of the furrows, of the fibres."),
       size("mottle_scale_mm", "Size of the spots, lobules or bundles."),
       share("mottle_amount", "Of the mottling."), colour("vessel_colour", "Of surface arteries."),
       colour("vein_colour", "Of surface veins."),
       share("vessel_amount", "Of surface vessels; 0: none."),
       size("vessel_scale_mm", "Between trunks of the vessels."),
       share("fat_amount", "Of the surface that lies under islands of fat; 0: none."),
       number("bump_height_mm", "Height of the relief.").needed().between(0, 10),
       size("bump_scale_mm", "Width of the relief."),
       share("roughness", "Of the surface under its film: 0 a mirror, 1 matte."),
       share("wetness", "0 dry ... 1 wet."),
       share("translucency", "How far light wraps round the terminator.")},
      {},
      {}};
}

ObjectSpec prony_term() {
  return {"One exponential of a Prony series.",
          {quantity("g", "1", 1e-6, 0.95, "Share of the instantaneous modulus.").needed(),
           quantity("tau", "s", 1e-3, 1e5, "In this time to 1/e.").needed()},
          {},
          {}};
}

ObjectSpec tissue_fibres() {
  return {"One family of fibres.",
          {vector("direction", "Along them, in the organ's own frame; of any length but zero.")
               .needed()
               .between(-1e6, 1e6),
           quantity("modulus", "Pa", 0, 1e9, "What they add to the modulus along them.").needed()},
          {},
          {has_direction("direction")}};
}

ObjectSpec tissue() {
  ObjectSpec spec;
  spec.exactly_one_of = {"youngs_modulus", "shear_modulus"};
  spec.keys = {
      quantity("youngs_modulus", "Pa", 1, 1e9, "E, small strain, drained."),
      quantity("shear_modulus", "Pa", 1, 1e9, "G; E = 2 G (1 + nu)."),
      quantity("poisson_ratio", "1", 0, 0.4999, "nu.").needed(),
      quantity("density", "kg/m3", 1, 5000, "Mass density.").needed(),
      list("prony", "How force relaxes; E is then the long-term modulus.", prony_term())
          .items(1, PronyForce::kMostTerms),
      object("fibres", "Fibres that it is woven of; without it, none.", tissue_fibres()),
      quantity("ultimate_strength", "Pa", 1, 1e9, "Stress at failure."),
      quantity("ultimate_strain", "1", 0, 10, "Strain at failure."),
      quantity("fracture_energy", "J/m2", 0.1, 1e6, "What a blade's cut takes for its area."),
      quantity("electrical_conductivity", "S/m", 0, 10, "At 500 kHz."),
      quantity("specific_heat", "J/(kg K)", 100, 10000, "At constant pressure."),
      quantity("thermal_conductivity", "W/(m K)", 0.001, 10, "Fourier's."),
      quantity("perfusion", "mL/(min kg)", 0, 10000, "Blood flow."),
      quantity("water_fraction", "1", 0, 1, "Mass fraction of water."),
      quantity("coagulation_frequency", "1/s", 0, 1e120, "Arrhenius A of half of the whitening."),
      quantity("coagulation_energy", "J/mol", 0, 1e7, "Its Arrhenius Ea."),
      quantity("smoke_yield", "1", 0, 1, "Share of the vaporised mass that is seen as smoke."),
      object("look", "How the renderer paints it.", look()).needed(),
  };
  return spec;
}

const ObjectSpec& tissue_file_keys() {
  static const ObjectSpec spec{"Tissues by name.",
                               {integer("version", "Of the format.").needed().one_of({1}),
                                map("tissues", "Tissues by name.", tissue()).needed()},
                               {},
                               {}};
  return spec;
}

double linear_from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

TissueLook look_of(const Json& values) {
  const bool srgb = values["colour_space"] == "srgb";
  const auto metres = [&](const char* key) { return values[key].get<double>() / 1000.0; };
  const auto linear = [&](const char* key) {
    Vec3 colour;
    for (int c = 0; c < 3; ++c) {
      const double value = values[key][static_cast<std::size_t>(c)].get<double>();
      colour[c] = srgb ? linear_from_srgb(value) : value;
    }
    return colour;
  };
  TissueLook look;
  for (const auto& [name, pattern] : kPatterns)
    if (values["pattern"] == name) look.pattern = pattern;
  look.colour = linear("colour");
  look.mottle_colour = linear("mottle_colour");
  look.mottle_scale = metres("mottle_scale_mm");
  look.mottle_amount = values["mottle_amount"];
  look.vessel_colour = linear("vessel_colour");
  look.vein_colour = linear("vein_colour");
  look.vessel_amount = values["vessel_amount"];
  look.vessel_scale = metres("vessel_scale_mm");
  look.fat_amount = values["fat_amount"];
  look.bump_height = metres("bump_height_mm");
  look.bump_scale = metres("bump_scale_mm");
  look.roughness = values["roughness"];
  look.wetness = values["wetness"];
  look.translucency = values["translucency"];
  return look;
}

/// What heat needs beyond the density, and where it goes.
struct ThermalKey {
  const char* name;
  void (*take)(ThermalTissue& thermal, double value);
};
constexpr std::array kThermalKeys = {
    ThermalKey{"electrical_conductivity",
               [](ThermalTissue& t, double value) { t.electric_conductivity = value; }},
    ThermalKey{"specific_heat", [](ThermalTissue& t, double value) { t.specific_heat = value; }},
    ThermalKey{"thermal_conductivity",
               [](ThermalTissue& t, double value) { t.conductivity = value; }},
    ThermalKey{"perfusion", [](ThermalTissue& t,
                               double value) { t.perfusion = perfusion_rate(value, t.density); }},
    ThermalKey{"water_fraction", [](ThermalTissue& t, double value) { t.water_fraction = value; }},
    ThermalKey{"coagulation_frequency",
               [](ThermalTissue& t, double value) { t.coagulation.frequency = value; }},
    ThermalKey{"coagulation_energy",
               [](ThermalTissue& t, double value) { t.coagulation.energy = value; }},
    ThermalKey{"smoke_yield", [](ThermalTissue& t, double value) { t.smoke_yield = value; }},
};

void take_thermal(const Json& values, Tissue& tissue) {
  ThermalTissue thermal;
  thermal.density = tissue.density;
  for (const ThermalKey& key : kThermalKeys) {
    if (values.contains(key.name))
      key.take(thermal, value_of(values[key.name]));
    else
      tissue.thermal_lacks.emplace_back(key.name);
  }
  if (tissue.thermal_lacks.empty()) tissue.thermal = thermal;
}

Tissue tissue_of(const std::string& name, const Json& values) {
  Tissue tissue;
  tissue.name = name;
  const double poisson_ratio = value_of(values["poisson_ratio"]);
  tissue.elastic.poisson_ratio = poisson_ratio;
  tissue.elastic.youngs_modulus =
      values.contains("youngs_modulus")
          ? value_of(values["youngs_modulus"])
          : 2.0 * value_of(values["shear_modulus"]) * (1.0 + poisson_ratio);
  tissue.density = value_of(values["density"]);
  if (values.contains("fracture_energy"))
    tissue.fracture_energy = value_of(values["fracture_energy"]);
  if (values.contains("ultimate_strain"))
    tissue.ultimate_strain = value_of(values["ultimate_strain"]);
  if (values.contains("prony"))
    for (const Json& term : values["prony"])
      tissue.prony.push_back({value_of(term["g"]), value_of(term["tau"])});
  if (values.contains("fibres"))
    tissue.fibres = {direction_of(values["fibres"]["direction"]),
                     value_of(values["fibres"]["modulus"])};
  take_thermal(values, tissue);
  tissue.look = look_of(values["look"]);
  return tissue;
}

}  // namespace

Result<void> check_materials(const SceneDescription& scene,
                             const std::map<std::string, Tissue>& tissues) {
  Error error;
  for (std::size_t i = 0; i < scene.organs.size(); ++i) {
    const OrganDescription& organ = scene.organs[i];
    if (!organ.material.relaxes || !tissues.at(organ.tissue).prony.empty()) continue;
    std::string known;
    for (const auto& [name, tissue] : tissues)
      if (!tissue.prony.empty()) known += (known.empty() ? "" : ", ") + name;
    error.messages.push_back(
        fmt::format("{}: organs/{}/material/relaxes: found true with the tissue \"{}\", which has "
                    "no Prony series; "
                    "expected one that has ({}), or a \"prony\" of its own",
                    scene.file.string(), i, organ.tissue, known));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

Result<std::map<std::string, Tissue>> load_tissues(const std::filesystem::path& file) {
  Result<Json> root = read_json(file);
  if (!root) return std::unexpected(root.error());
  Error error;
  for (const Mistake& mistake : validate(*root, tissue_file_keys(), {})) {
    const std::string at = mistake.path.empty() ? "" : mistake.path + ": ";
    error.messages.push_back(file.string() + ": " + at + mistake.text);
  }
  if (!error.messages.empty()) return std::unexpected(error);
  std::map<std::string, Tissue> tissues;
  for (const auto& [name, values] : (*root)["tissues"].items()) {
    const Tissue& tissue = tissues.emplace(name, tissue_of(name, values)).first->second;
    if (!tissue.thermal) continue;
    // Values that are possible each for itself may not be so together.
    if (const auto sound = check(*tissue.thermal); !sound)
      for (const std::string& mistake : sound.error().messages)
        error.messages.push_back(file.string() + ": tissues/" + name + ": " + mistake);
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return tissues;
}

}  // namespace viscera
