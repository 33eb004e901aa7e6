// Files of others, whose formats are read by a child process (reader_process.h). What it hands back
// is checked here.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/cache_file.h"
#include "engine/io/label_volume.h"
#include "engine/io/smoke_info.h"
#include "kernels/points/surface.h"

namespace viscera {

/// What viscera_reader reads; its arguments behind the file.
inline constexpr std::string_view kSurfaceReader = "surface";  ///< metres per unit
inline constexpr std::string_view kLabelReader = "labels";
inline constexpr std::string_view kSmokeReader = "smoke";
inline constexpr std::string_view kSealedReader = "sealed";  ///< format, key

/// As import_surface_here() (mesh_import.h).
Result<TriangleSurface> import_surface(const std::filesystem::path& file, double unit);

/// As read_nifti() and read_nrrd(), by the file's name.
Result<LabelVolume> read_label_volume(const std::filesystem::path& file);

/// As read_smoke_info_here() (vdb_volume.h).
Result<SmokeFileInfo> read_smoke_info(const std::filesystem::path& file);

/// As read_cache_file(), of a file that may be somebody else's.
Result<CacheData> read_sealed_file(const std::filesystem::path& file, int format,
                                   const std::string& key);

/// CacheData on its way.
struct SealedContents {
  std::map<std::string, std::string> texts;
  std::map<std::string, std::vector<double>> doubles;
  std::map<std::string, std::vector<float>> floats;
  std::map<std::string, std::vector<int>> integers;
  static constexpr auto fields() {
    return std::tuple(
        field("texts", &SealedContents::texts), field("doubles", &SealedContents::doubles),
        field("floats", &SealedContents::floats), field("integers", &SealedContents::integers));
  }
};
static_assert(fields_cover<SealedContents>());

/// The files that a .gltf keeps its numbers in, all beside it. Fails where one would lie elsewhere.
Result<std::vector<std::filesystem::path>> gltf_buffers(const std::filesystem::path& file);

}  // namespace viscera
