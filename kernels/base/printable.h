// Text of others (files, names, libraries) as a terminal may show it.
#pragma once

#include <string>
#include <string_view>

namespace viscera {

/// The same text, with what a terminal would obey or can't show replaced: control characters, bytes
/// that aren't UTF-8 and characters that turn the direction of writing become "\x1b", "\u202e".
/// Line ends stay.
std::string printable(std::string_view text);

/// The beginning of a longer text, whole characters: at most so many bytes, and "..." for the rest.
std::string shortened(std::string_view text, std::size_t most);

}  // namespace viscera
