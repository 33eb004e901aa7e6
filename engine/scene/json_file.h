// JSON text with comments, read into values whose keys keep the file's order, so that mistakes are
// listed in the order in which their author meets them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "kernels/base/result.h"

namespace viscera {

using Json = nlohmann::ordered_json;

inline constexpr std::uintmax_t kMaxJsonBytes = 16u << 20;  ///< greater files aren't opened
inline constexpr std::size_t kMaxJsonDepth = 64;
inline constexpr std::size_t kMaxJsonMembers = 1000;  ///< keys of one object

/// Refuses, before it reads: a file that is missing, a folder, not a regular file, empty or greater
/// than kMaxJsonBytes. Then as parse_json.
Result<Json> read_json(const std::filesystem::path& file);

/// Refuses binary data, broken syntax ("SOURCE:LINE:COLUMN: found ..., expected ..."), numbers that
/// aren't finite, keys that stand twice in one object, and nesting beyond kMaxJsonDepth.
Result<Json> parse_json(const std::string& text, const std::string& source);

}  // namespace viscera
