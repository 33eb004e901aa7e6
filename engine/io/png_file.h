// Pictures as PNG.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

enum class PngEffort { kFast, kSmall };

/// A PNG in memory of 8-bit sRGB, rows from the top, 3 bytes a pixel. Fails for a size that the
/// pixels don't fit.
Result<std::string> png_bytes(int width, int height, std::span<const std::uint8_t> rgb,
                              PngEffort effort);

/// What write_png() wrote: 8-bit RGB, rows from the top.
struct PngPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
/// Reads such a file back. Fails where there is none, or it is damaged or of another kind.
Result<PngPicture> read_png(const std::filesystem::path& file);

/// Writes 8-bit sRGB, rows from the top, 3 bytes a pixel. Compressed lightly: frames are many. Not
/// synced to the disk one by one for the same reason; a killed run still leaves only whole files.
/// Fails for a size that the pixels don't fit, a folder that is missing, a full disk.
Result<void> write_png(const std::filesystem::path& file, int width, int height,
                       std::span<const std::uint8_t> rgb);

}  // namespace viscera
