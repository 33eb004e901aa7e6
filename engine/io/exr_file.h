// Pictures of many channels as OpenEXR files, whose library is seen in one source alone.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// A channel by name ("depth", "clean.R"): one value a pixel, rows from the top.
struct ExrChannel {
  std::string name;
  std::variant<std::vector<float>, std::vector<std::uint32_t>> values;
  bool half = false;  ///< stores floats in half precision
};

struct ExrPicture {
  int width = 0, height = 0;
  std::vector<ExrChannel> channels;
  std::vector<std::pair<std::string, std::string>> texts;  ///< attributes of the header
  std::vector<std::pair<std::string, double>> numbers;     ///< likewise
};

/// The bytes of an .exr file, compressed without loss. Errors: channels that don't fit the size, or
/// what OpenEXR reports.
Result<std::string> encode_exr(const ExrPicture& picture);

/// Whole or absent, as all files: written under a temporary name first.
Result<void> write_exr(const std::filesystem::path& file, const ExrPicture& picture);

}  // namespace viscera
