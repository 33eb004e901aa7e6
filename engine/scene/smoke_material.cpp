#include "engine/scene/smoke_material.h"

#include "engine/scene/quantities.h"
#include "engine/scene/validate.h"

namespace viscera {
namespace {

const ObjectSpec& smoke_file_keys() {
  static const ObjectSpec spec{
      "Smoke of burnt tissue.",
      {integer("version", "Of the format.").needed().one_of({1}),
       object("optics", "How it meets light in the visible.",
              {"Optics.",
               {quantity("mass_extinction", "m2/kg", 0, 1e6, "Cross-section a mass.").needed(),
                quantity("albedo", "1", 0, 1, "Scattered share of what is taken.").needed(),
                quantity("asymmetry", "1", -0.95, 0.95, "Henyey and Greenstein's g.").needed()},
               {},
               {}})
           .needed()},
      {},
      {}};
  return spec;
}

}  // namespace

Result<SmokeOptics> load_smoke_optics(const std::filesystem::path& file) {
  Result<Json> root = read_json(file);
  if (!root) return std::unexpected(root.error());
  Error error;
  for (const Mistake& mistake : validate(*root, smoke_file_keys(), {})) {
    const std::string at = mistake.path.empty() ? "" : mistake.path + ": ";
    error.messages.push_back(file.string() + ": " + at + mistake.text);
  }
  if (!error.messages.empty()) return std::unexpected(error);
  const Json& optics = (*root)["optics"];
  return SmokeOptics{value_of(optics["mass_extinction"]), value_of(optics["albedo"]),
                     value_of(optics["asymmetry"])};
}

}  // namespace viscera
