#include "engine/features/smoke/smoke_keys.h"

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

constexpr double kMostVoxels = 512.0 * 512.0 * 512.0;

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

ObjectSpec smoke_spec() {
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

// An emitter that names an instrument names one that burns.
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
                  if (tool["name"] == emitter["instrument"] &&
                      !is_among({"hook", "spatula", "scissors"}, tool["kind"]))
                    return {{"smoke/" + std::to_string(s) + "/emitters/" + std::to_string(e) +
                                 "/instrument",
                             "found " + emitter["instrument"].dump() + ", which is a " +
                                 tool["kind"].get<std::string>() +
                                 ", expected a hook, a spatula or scissors"}};
              }
            }
            return {};
          },
          nullptr};
}

EmitterDescription read_emitter(const Json& values) {
  constexpr double kKilogram = 1e-6;  // of one mg
  EmitterDescription emitter;
  if (values.contains("instrument")) {
    emitter.instrument = values["instrument"];
    return emitter;
  }
  emitter.position = from_milli_vector(values["position_mm"]);
  emitter.direction = direction_of(values["direction"]);
  emitter.radius = from_milli(values["radius_mm"]);
  emitter.rate = values["rate_mg_per_s"].get<double>() * kKilogram;
  emitter.particles = values["particles_per_s"];
  emitter.speed = from_milli(values["speed_mm_per_s"]);
  emitter.excess = values["excess_K"];
  emitter.when = interval_of(values);
  return emitter;
}

SmokeDescription read_volume(const Json& values) {
  constexpr double kKilogram = 1e-9;  // of one ug
  SmokeDescription smoke;
  smoke.name = values["name"];
  smoke.domain = box_of(values["domain"]);
  smoke.voxel = from_milli(values["voxel_mm"]);
  smoke.max_particles = values["max_particles"];
  smoke.spacing = from_milli(values["spacing_mm"]);
  if (values["laplacian"] == "paper") smoke.laplacian = Laplacian::kPaper;
  smoke.lifetime = values["lifetime_s"];
  smoke.particle_mass = values["particle_mass_ug"].get<double>() * kKilogram;
  smoke.look = values["look"] == "sprites" ? SmokeLook::kSprites : SmokeLook::kMarch;
  if (values.contains("emitters"))
    for (const Json& emitter : values["emitters"]) smoke.emitters.push_back(read_emitter(emitter));
  return smoke;
}

}  // namespace

std::span<const SmokeDescription> smoke_of(const SceneDescription& scene) {
  const auto* smoke = scene.extras.find<SmokeDescriptions>();
  return smoke ? std::span<const SmokeDescription>(*smoke) : std::span<const SmokeDescription>();
}

FeatureKeys smoke_keys() {
  FeatureKeys keys;
  keys.scene.keys = {list("smoke", "Volumes that smoke may fill; none: no smoke.", smoke_spec())
                         .items(0, 8)
                         .unique_by("name")
                         .otherwise(Json::array())};
  keys.scene.checks = {emitters_burn()};
  keys.scene.read = [](const Json& scene, Extras& extras) {
    SmokeDescriptions volumes;
    for (const Json& smoke : scene["smoke"]) volumes.push_back(read_volume(smoke));
    extras.set(std::move(volumes));
  };
  return keys;
}

}  // namespace viscera
