#include "engine/scene/smoke_material.h"

#include "engine/scene/quantities.h"
#include "engine/scene/validate.h"

namespace viscera {
namespace {

ObjectSpec droplet_keys() {
  ObjectSpec spec;
  spec.description = "Droplets, lognormal in size.";
  spec.keys = {
      quantity("median_diameter", "m", 1e-8, 1e-4, "Half of the mass is in smaller ones.").needed(),
      quantity("geometric_deviation", "1", 1.0, 5.0, "Of the sizes.").needed(),
      quantity("density", "kg/m3", 100, 5000, "Of what they are made of.").needed(),
      quantity("refraction", "1", 1.0, 3.0, "Real part of the refractive index.").needed(),
      quantity("absorption", "1", 0.0, 2.0, "Imaginary part of it.").needed(),
      quantity("wavelength", "m", 3e-7, 1e-6, "Of the light that they meet.").needed()};
  return spec;
}

ObjectSpec motion_keys() {
  ObjectSpec spec;
  spec.description = "What carries smoke besides the resolved flow.";
  spec.keys = {
      quantity("jet_entrainment", "1", 0.0, 1.0, "Of a jet: speed of what flows in over its own.")
          .needed(),
      quantity("eddy_share", "1", 0.0, 1.0,
               "Without a grid: speed of the eddies over a parcel's own.")
          .needed(),
      quantity("eddy_wavelength", "m", 1e-4, 1.0, "Without a grid: of their waves.").needed(),
      quantity("eddy_period", "s", 1e-3, 100.0, "In which waves of that length change.").needed(),
      quantity("eddy_white_share", "1", 0.0, 1.0,
               "Deviation of what each parcel has of its own in 1/60 s, over the eddies' speed.")
          .needed()};
  return spec;
}

const ObjectSpec& smoke_file_keys() {
  static const ObjectSpec spec{
      "Smoke of burnt tissue.",
      {integer("version", "Of the format.").needed().one_of({2}),
       object("droplets", "What smoke consists of.", droplet_keys()).needed(),
       object("motion", "How it moves.", motion_keys()).needed()},
      {},
      {}};
  return spec;
}

}  // namespace

Result<SmokeMaterial> load_smoke_material(const std::filesystem::path& file) {
  Result<Json> root = read_json(file);
  if (!root) return std::unexpected(root.error());
  Error error;
  for (const Mistake& mistake : validate(*root, smoke_file_keys(), {})) {
    const std::string at = mistake.path.empty() ? "" : mistake.path + ": ";
    error.messages.push_back(file.string() + ": " + at + mistake.text);
  }
  if (!error.messages.empty()) return std::unexpected(error);
  const Json &droplets = (*root)["droplets"], &motion = (*root)["motion"];
  return SmokeMaterial{.droplets = {.median = value_of(droplets["median_diameter"]),
                                    .deviation = value_of(droplets["geometric_deviation"]),
                                    .density = value_of(droplets["density"]),
                                    .refraction = value_of(droplets["refraction"]),
                                    .absorption = value_of(droplets["absorption"])},
                       .wavelength = value_of(droplets["wavelength"]),
                       .eddies = {.share = value_of(motion["eddy_share"]),
                                  .wavelength = value_of(motion["eddy_wavelength"]),
                                  .period = value_of(motion["eddy_period"]),
                                  .white = value_of(motion["eddy_white_share"])},
                       .jet_entrainment = value_of(motion["jet_entrainment"])};
}

}  // namespace viscera
