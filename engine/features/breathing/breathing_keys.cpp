#include "engine/features/breathing/breathing_keys.h"

#include <cmath>
#include <numbers>

#include "engine/scene/common_keys.h"
#include "engine/scene/to_si.h"

namespace viscera {
namespace {

ObjectSpec motion_spec() {
  return {
      "Breathing: the organ goes from its pose along a line and back, with a pause there.",
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

void set_motion(OrganDescription& organ, const MotionDescription& motion) {
  add_motion(organ.extras, motion);
}

FeatureKeys breathing_keys() {
  FeatureKeys keys;
  keys.organ.keys = {
      object("motion", "How breathing moves it; without it, it stays.", motion_spec())};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (!organ.contains("motion")) return;
    const Json& values = organ["motion"];
    add_motion(extras, {.amplitude = from_milli(values["amplitude_mm"]),
                        .direction = direction_of(values["direction"]),
                        .period = values["period_s"],
                        .phase = radians(values["phase_deg"])});
  };
  return keys;
}

}  // namespace viscera
