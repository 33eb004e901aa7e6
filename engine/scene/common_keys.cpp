#include "engine/scene/common_keys.h"

#include <cmath>

namespace viscera {
namespace {

ObjectCheck corners_in_order() {
  return {{"min_mm", "max_mm"},
          [](const Json& box) -> Finding {
            for (int i = 0; i < 3; ++i) {
              if (component(box["min_mm"], i) < component(box["max_mm"], i)) continue;
              return {{"max_mm", "found " + box["max_mm"].dump() + ", expected each component " +
                                     "above that of min_mm " + box["min_mm"].dump()}};
            }
            return {};
          },
          nullptr};
}

}  // namespace

double component(const Json& vector, int i) {
  return vector[i].get<double>();
}

double distance(const Json& a, const Json& b) {
  return std::hypot(component(a, 0) - component(b, 0), component(a, 1) - component(b, 1),
                    component(a, 2) - component(b, 2));
}

KeySpec position(std::string name, std::string description) {
  return vector(std::move(name), std::move(description)).between(-kFarthest_mm, kFarthest_mm);
}

KeySpec time_key(std::string description) {
  return number("time_s", std::move(description)).needed().between(0, kLongest_s);
}

KeySpec direction_key(std::string description, Json otherwise) {
  return vector("direction", std::move(description))
      .between(-1e6, 1e6)
      .otherwise(std::move(otherwise));
}

ObjectCheck has_direction(std::string name) {
  return {{name},
          [name](const Json& values) -> Finding {
            const Json& found = values[name];
            if (distance(found, Json{0, 0, 0}) > 1e-9) return {};
            return {{name, "found " + found.dump() + ", expected a direction"}};
          },
          nullptr};
}

ObjectSpec fibres() {
  return {"One family of fibres, which stiffen tissue along themselves; pressed they buckle.",
          {vector("direction", "Along them, in the organ's own frame; of any length but zero.")
               .needed()
               .between(-1e6, 1e6),
           number("modulus_kPa",
                  "What they add to the modulus along them, in small strains; 0: there are none.")
               .needed()
               .between(0, 1e6)},
          {},
          {has_direction("direction")}};
}

ObjectSpec box(std::string description) {
  return {std::move(description),
          {position("min_mm", "Least corner.").needed(),
           position("max_mm", "Greatest corner.").needed()},
          {},
          {corners_in_order()}};
}

ObjectSpec ball() {
  return {"A ball.",
          {position("centre_mm", "Its centre.").needed(),
           number("radius_mm", "Its radius.").needed().between(0.01, 5000)},
          {},
          {}};
}

ObjectSpec part_of_world() {
  return {"A part of the world, where the organs stand at their poses.",
          {object("sphere", "A ball.", ball()),
           object("box", "An axis-aligned box.", box("An axis-aligned box."))},
          {"sphere", "box"},
          {}};
}

ObjectCheck between_two() {
  return {{"between"},
          [](const Json& values) -> Finding {
            const Json& between = values["between"];
            if (between[0] != between[1]) return {};
            return {{"between/1",
                     "found " + between[1].dump() + " again, expected another than between/0"}};
          },
          {{"properties", {{"between", {{"uniqueItems", true}}}}}}};
}

Finding first_between_scenery(const Json& scene, const std::string& list) {
  const auto deforms = [&](const Json& name) {
    for (const Json& organ : scene["organs"])
      if (organ["name"] == name) return organ["deformable"].get<bool>();
    return false;
  };
  for (std::size_t i = 0; i < scene[list].size(); ++i) {
    const Json& between = scene[list][i]["between"];
    if (deforms(between[0]) || deforms(between[1])) continue;
    return {{list + "/" + std::to_string(i) + "/between",
             "found " + between.dump() + ", expected at least one deformable organ"}};
  }
  return {};
}

Finding first_outside(const Json& list, const std::string& path, const Json& low, const Json& high,
                      const std::string& box) {
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (!list[k].contains("position_mm")) continue;
    const Json& at = list[k]["position_mm"];
    for (int i = 0; i < 3; ++i)
      if (component(at, i) < component(low, i) || component(at, i) > component(high, i))
        return {{path + "/" + std::to_string(k) + "/position_mm",
                 "found " + at.dump() + ", expected a place inside " + box + ", " + low.dump() +
                     " to " + high.dump()}};
  }
  return {};
}

}  // namespace viscera
