// Kinds of keys that several parts of the scene format share.
#pragma once

#include "engine/scene/keys.h"

namespace viscera {

/// Of an ObjectCheck: the path below the object and "found X, expected Y".
using Finding = std::optional<std::pair<std::string, std::string>>;

constexpr double kFarthest_mm = 10000.0;  ///< of any position: a scene is of a body's size
constexpr double kLongest_s = 3600.0;     ///< of a scene

double component(const Json& vector, int i);
double distance(const Json& a, const Json& b);

KeySpec position(std::string name, std::string description);
/// "time_s" of a key frame.
KeySpec time_key(std::string description);
/// "direction": its length doesn't count.
KeySpec direction_key(std::string description, Json otherwise);
/// A vector whose length doesn't count isn't zero.
ObjectCheck has_direction(std::string name);
/// An axis-aligned box: min_mm and max_mm, in order.
ObjectSpec box(std::string description);
/// direction and modulus_kPa.
ObjectSpec fibres();
/// centre_mm and radius_mm.
ObjectSpec ball();

/// sphere or box: where what ties organs lies.
ObjectSpec part_of_world();
/// "between" names two organs, not one twice.
ObjectCheck between_two();
/// The first of a list's objects between organs of which none deforms.
Finding first_between_scenery(const Json& scene, const std::string& list);

/// The first of a list's places (position_mm) that doesn't lie in a box, below `path`.
Finding first_outside(const Json& list, const std::string& path, const Json& low, const Json& high,
                      const std::string& box);

}  // namespace viscera
