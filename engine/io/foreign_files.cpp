#include "engine/io/foreign_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "engine/io/reader_process.h"
#include "engine/scene/geometry_formats.h"
#include "kernels/base/input_file.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = std::uintmax_t{4} << 30;

Result<std::uintmax_t> size_of(const fs::path& file, std::string_view expected,
                               std::uintmax_t most) {
  const auto input = InputFile::open(file, expected, most);
  if (!input) return std::unexpected(input.error());
  return input->size();
}

Result<void> check(const TriangleSurface& surface, const std::string& name) {
  const auto vertices = static_cast<int>(surface.vertices.size());
  for (const auto& corners : surface.triangles)
    for (const int corner : corners)
      if (corner < 0 || corner >= vertices)
        return failure(fmt::format("{}: found vertex {} in a triangle, expected 0 to {}", name,
                                   corner, vertices - 1));
  for (const Vec3& vertex : surface.vertices)
    if (!vertex.allFinite())
      return failure(name + ": found a coordinate that isn't a finite number");
  return {};
}

Result<void> check(const LabelVolume& volume, const std::string& name) {
  constexpr int kMost = 1 << 30;
  std::size_t voxels = 1;
  for (const int edge : {volume.size.x(), volume.size.y(), volume.size.z()}) {
    if (edge < 1 || voxels > static_cast<std::size_t>(kMost / edge))
      return failure(name + ": found a volume of no size, or of more than 2^30 voxels");
    voxels *= static_cast<std::size_t>(edge);
  }
  if (volume.labels.size() == voxels) return {};
  return failure(
      fmt::format("{}: found {} voxels, expected {}", name, volume.labels.size(), voxels));
}

}  // namespace

Result<std::vector<fs::path>> gltf_buffers(const fs::path& file) {
  const auto text = read_input(file, "a surface", kMostGeometryBytes);
  if (!text) return std::unexpected(text.error());
  std::vector<fs::path> buffers;
  const nlohmann::json gltf = nlohmann::json::parse(*text, nullptr, false);
  if (!gltf.is_object() || !gltf.contains("buffers") || !gltf["buffers"].is_array()) return buffers;
  for (const nlohmann::json& buffer : gltf["buffers"]) {
    if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
    const std::string uri = buffer["uri"];
    if (uri.starts_with("data:")) continue;
    const auto inside = path_inside(file.parent_path(), uri);
    if (!inside) return failure(file.string() + ": buffers: " + inside.error().text());
    buffers.push_back(*inside);
  }
  return buffers;
}

Result<TriangleSurface> import_surface(const fs::path& file, double unit) {
  auto bytes = size_of(file, "a surface", kMostGeometryBytes);
  if (!bytes) return std::unexpected(bytes.error());
  if (geometry_extension(file) == ".gltf") {
    const auto buffers = gltf_buffers(file);
    if (!buffers) return std::unexpected(buffers.error());
    for (const fs::path& buffer : *buffers) {
      const auto more = size_of(buffer, "a buffer of " + file.string(), kMostGeometryBytes);
      if (!more) return std::unexpected(more.error());
      *bytes += *more;
    }
  }
  auto surface = read_by_child<TriangleSurface>(
      {kSurfaceReader, file, {fmt::format("{}", unit)}, ReadLimits::for_file(*bytes)});
  if (!surface) return surface;
  if (const auto sound = check(*surface, file.string()); !sound)
    return std::unexpected(sound.error());
  return surface;
}

Result<LabelVolume> read_label_volume(const fs::path& file) {
  const auto bytes = size_of(file, "a label map", kMostBytes);
  if (!bytes) return std::unexpected(bytes.error());
  // Of what a header says of its voxels only the reader knows: at most 2^30, packed a thousandfold.
  ReadLimits limits = ReadLimits::for_file(*bytes);
  limits.memory += 1000 * *bytes;
  limits.answer += 4000 * *bytes;
  limits.seconds += 10.0 * static_cast<double>(*bytes) / (1 << 20);
  auto volume = read_by_child<LabelVolume>({kLabelReader, file, {}, limits});
  if (!volume) return volume;
  if (const auto sound = check(*volume, file.string()); !sound)
    return std::unexpected(sound.error());
  return volume;
}

Result<SmokeFileInfo> read_smoke_info(const fs::path& file) {
  const auto bytes = size_of(file, "a .vdb file", kMostBytes);
  if (!bytes) return std::unexpected(bytes.error());
  return read_by_child<SmokeFileInfo>({kSmokeReader, file, {}, ReadLimits::for_file(*bytes)});
}

Result<CacheData> read_sealed_file(const fs::path& file, int format, const std::string& key) {
  const auto bytes = size_of(file, "a file that Viscera wrote", kMostBytes);
  if (!bytes) return std::unexpected(bytes.error());
  auto contents = read_by_child<SealedContents>(
      {kSealedReader, file, {std::to_string(format), key}, ReadLimits::for_file(*bytes)});
  if (!contents) return std::unexpected(contents.error());
  CacheData data;
  data.texts() = std::move(contents->texts);
  for (auto& [name, values] : contents->doubles) data.arrays()[name] = std::move(values);
  for (auto& [name, values] : contents->floats) data.arrays()[name] = std::move(values);
  for (auto& [name, values] : contents->integers) data.arrays()[name] = std::move(values);
  return data;
}

}  // namespace viscera
