// Whole files in memory, unpacked where they are gzip files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "kernels/base/result.h"

namespace viscera {

/// Unpacked data beyond this is refused [bytes].
inline constexpr std::size_t kMostUnpacked = std::size_t{2} << 30;

/// Unpacks a gzip or zlib stream; `name` opens the messages. Fails where the stream is damaged,
/// ends early, or holds more than kMostUnpacked.
Result<std::string> unpacked(std::string_view packed, const std::string& name);

/// The file's bytes; unpacked where they begin as gzip does. Fails where there is no such file, it
/// isn't a regular one, it is empty or can't be read.
Result<std::string> read_bytes(const std::filesystem::path& file, bool unpack);

}  // namespace viscera
