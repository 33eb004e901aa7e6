#include "engine/io/base64.h"

#include <cstdint>

namespace viscera {

std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    std::uint32_t group = 0;
    for (std::size_t b = 0; b < 3; ++b) {
      group = group << 8 | (at + b < bytes.size() ? static_cast<unsigned char>(bytes[at + b]) : 0u);
    }
    for (std::size_t c = 0; c < 4; ++c) {
      text += at + c > bytes.size() ? '=' : kLetters[group >> (18 - 6 * c) & 63u];
    }
  }
  return text;
}

}  // namespace viscera
