// Which of the words that were expected did the author mean?
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace viscera {

/// The nearest of `candidates` by edit distance (insertion, deletion, replacement, swap of
/// neighbours; case ignored), or "" when none is near enough to be meant. The first wins a tie.
std::string nearest_spelling(std::string_view word, const std::vector<std::string>& candidates);

/// ` (did you mean "liver"?)`, or "" when nothing is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

/// "radius_mm" -> {"radius", "mm"}; a name without a known unit has the unit "".
struct UnitSplit {
  std::string stem, unit;
};
UnitSplit split_unit(std::string_view key);

/// "a, b, c"
std::string joined(const std::vector<std::string>& words);

}  // namespace viscera
