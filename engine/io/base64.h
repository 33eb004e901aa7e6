// Bytes as text, for data inside pages.
#pragma once

#include <string>
#include <string_view>

namespace viscera {

/// RFC 4648, padded, without line breaks.
std::string base64(std::string_view bytes);

}  // namespace viscera
