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

/// Of label maps, and of maps of moduli.
inline constexpr std::array kVolumeEndings = {".nii", ".nii.gz", ".nrrd", ".nhdr"};

inline bool is_volume_file(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::any_of(kVolumeEndings,
                             [&](const char* ending) { return name.ends_with(ending); });
}

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
