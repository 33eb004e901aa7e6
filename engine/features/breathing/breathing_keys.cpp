#include "engine/features/breathing/breathing_keys.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

/// Of what goes so; `own`: keys besides.
ObjectSpec motion_spec(std::string description, std::vector<KeySpec> own = {}) {
  ObjectSpec spec{
      std::move(description),
      {number("amplitude_mm", "Greatest way.").needed().between(0, 100),
       vector("direction", "Of the way; its length doesn't matter.")
           .between(-1000, 1000)
           .otherwise({0, -1, 0}),
       number("period_s", "Of one breath.").between(0.2, 1000).otherwise(4.0),
       number("phase_deg", "Of the breath at time 0, at 0 at its pose, at 180 farthest from it.")
           .between(-360, 360)
           .otherwise(0.0)},
      {},
      {has_direction("direction")}};
  spec.keys.insert(spec.keys.begin(), own.begin(), own.end());
  return spec;
}

MotionDescription motion_from(const Json& values) {
  return {.amplitude = from_milli(values["amplitude_mm"]),
          .direction = direction_of(values["direction"]),
          .period = values["period_s"],
          .phase = radians(values["phase_deg"])};
}

struct HoldMotions {
  std::vector<HoldMotion> all;
};

/// Each names a region that there is.
ObjectCheck holds_are_there() {
  return {{"moving_holds", "fixed"},
          [](const Json& organ) -> std::optional<std::pair<std::string, std::string>> {
            const Json& list = organ["moving_holds"];
            for (std::size_t i = 0; i < list.size(); ++i) {
              const auto hold = list[i]["fixed"].get<std::size_t>();
              if (hold < organ["fixed"].size()) continue;
              return {{fmt::format("moving_holds/{}/fixed", i),
                       fmt::format("found {}, expected the index of one of the {} regions of fixed",
                                   hold, organ["fixed"].size())}};
            }
            return {};
          },
          {}};
}

void add_motion(Extras& organ, const MotionDescription& motion) {
  organ.set(motion);
  organ.set(FrameMotion{[motion](double time) { return motion.displacement(time); }});
}

}  // namespace

Vec3 MotionDescription::displacement(double time) const {
  const double s = std::sin(std::numbers::pi * time / period + 0.5 * phase);
  return amplitude * (s * s) * (s * s) * direction;
}

Vec3 MotionDescription::velocity(double time) const {
  const double angle = std::numbers::pi * time / period + 0.5 * phase;
  const double s = std::sin(angle);
  return 4.0 * std::numbers::pi / period * amplitude * (s * s * s) * std::cos(angle) * direction;
}

const MotionDescription* motion_of(const OrganDescription& organ) {
  return organ.extras.find<MotionDescription>();
}

const std::vector<HoldMotion>& hold_motions_of(const OrganDescription& organ) {
  static const std::vector<HoldMotion> none;
  const HoldMotions* holds = organ.extras.find<HoldMotions>();
  return holds ? holds->all : none;
}

void set_hold_motions(OrganDescription& organ, std::vector<HoldMotion> motions) {
  organ.extras.set(HoldMotions{std::move(motions)});
}

void set_motion(OrganDescription& organ, const MotionDescription& motion) {
  add_motion(organ.extras, motion);
}

FeatureKeys breathing_keys() {
  FeatureKeys keys;
  keys.organ.keys = {
      object("motion", "How breathing moves it; without it, it stays.",
             motion_spec("Breathing: the organ goes from its pose along a line and back, with a "
                         "pause there.")),
      list("moving_holds",
           "Holds that breathing moves against the others: the tissue between them is stretched. "
           "An organ whose holds all go alike has a motion.",
           motion_spec(
               "What holds the surface in one region goes along a line and back, with a "
               "pause there; with the organ's own motion, if it has one.",
               {integer("fixed", "Index of the region; what earlier regions hold too is theirs.")
                    .needed()
                    .between(0, 99)}))
          .items(0, 100)
          .ascending_by("fixed")
          .otherwise(Json::array())};
  keys.organ.checks = {holds_are_there()};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (organ.contains("motion")) add_motion(extras, motion_from(organ["motion"]));
    HoldMotions holds;
    for (const Json& values : organ["moving_holds"])
      holds.all.push_back({.hold = values["fixed"], .motion = motion_from(values)});
    if (!holds.all.empty()) extras.set(std::move(holds));
  };
  return keys;
}

}  // namespace viscera
