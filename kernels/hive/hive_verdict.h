// How building a hive or pressing it ended.
#pragma once

#include <string_view>

namespace viscera {

/// A hive whose verdict isn't sound gives no force.
enum class HiveVerdict {
  kSound,
  kNotFinite,     ///< a number that came in isn't finite, or a cell has no area or direction
  kNotOnSurface,  ///< no place to stand on, or the region leaves an open surface
  kTooWide,       ///< the contact reaches the periphery: a larger radius is needed
  kFolded,        ///< layers run into each other: too deep or wide for how the surface bends
  kNotPositive,   ///< the condensed compliance could give out energy
  kTooMany,       ///< more cells than the hive was created for
  kNotBuilt,      ///< pressed before seated, seated before built
};

constexpr std::string_view name_of(HiveVerdict verdict) {
  constexpr std::string_view names[] = {"sound",    "not finite", "not on the surface",
                                        "too wide", "folded",     "not positive",
                                        "too many", "not built"};
  return names[static_cast<int>(verdict)];
}

}  // namespace viscera
