// The surface formats that are read, by how their files' names end.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <string>

namespace viscera {

/// Of a surface's file, and of each that it names.
inline constexpr std::uintmax_t kMostGeometryBytes = 2ull << 30;

inline constexpr std::array kGeometryExtensions = {".obj", ".stl", ".ply", ".gltf", ".glb"};

/// In lower case, with the dot: ".obj".
inline std::string geometry_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

inline bool is_geometry_file(const std::filesystem::path& file) {
  return std::ranges::find(kGeometryExtensions, geometry_extension(file)) !=
         kGeometryExtensions.end();
}

}  // namespace viscera
