#include "engine/organ/prepared_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "engine/io/cache_quota.h"
#include "engine/io/foreign_files.h"
#include "engine/io/response_cache.h"
#include "engine/organ/recipe.h"
#include "engine/organ/shape.h"
#include "engine/organ/shape_file.h"
#include "engine/scene/geometry_formats.h"
#include "kernels/base/hash.h"
#include "kernels/base/input_file.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

/// Raised when shapes change in a way that their inputs don't show.
constexpr int kShapeVersion = 1;

void hash_vector(Hasher& hasher, const Vec3& v) {
  for (int c = 0; c < 3; ++c) hasher.value(v[c]);
}

Result<void> hash_surface_file(Hasher& hasher, const fs::path& file) {
  return hash_file(hasher, file, "part of a surface");
}

}  // namespace

Result<void> hash_file(Hasher& hasher, const fs::path& file, std::string_view expected) {
  auto in = InputFile::open(file, expected, kMostGeometryBytes);
  if (!in) return std::unexpected(in.error());
  std::vector<char> block(1 << 20);
  for (;;) {
    const auto got = in->read(block.data(), block.size());
    if (!got) return std::unexpected(got.error());
    if (*got == 0) return {};
    hasher.bytes(block.data(), *got);
  }
}

namespace {

bool is_built_in(const std::string& recipe) {
  return recipe == "sphere" || recipe == "hemisphere" || recipe == "block";
}

/// A .gltf names its buffers as files of their own: they are part of the surface.
Result<void> hash_gltf_buffers(Hasher& hasher, const fs::path& file) {
  const auto buffers = gltf_buffers(file);
  if (!buffers) return std::unexpected(buffers.error());
  for (const fs::path& buffer : *buffers)
    if (auto hashed = hash_surface_file(hasher, buffer); !hashed) return hashed;
  return {};
}

Result<void> hash_geometry(Hasher& hasher, const OrganGeometry& geometry, const fs::path& assets) {
  if (const auto* recipe = std::get_if<RecipeGeometry>(&geometry)) {
    hasher.text("recipe").text(recipe->recipe);
    hasher.value(recipe->seed).value(recipe->edge).value(recipe->triangles.value_or(0));
    hasher.value(recipe->radius).value(recipe->scale);
    hash_vector(hasher, recipe->size);
    if (is_built_in(recipe->recipe)) return {};
    for (const fs::path& part : recipe_files(assets, recipe->recipe))
      if (auto hashed = hash_surface_file(hasher, part); !hashed) return hashed;
    return {};
  }
  const auto& file = std::get<FileGeometry>(geometry);
  hasher.text("file").value(file.unit).value(file.recentre).value(file.edge);
  if (file.wrap) hasher.text("wrap").value(file.wrap->voxel).value(file.wrap->close);
  if (file.file.extension() == ".gltf")
    if (auto hashed = hash_gltf_buffers(hasher, file.file); !hashed) return hashed;
  return hash_surface_file(hasher, file.file);
}

}  // namespace

void warn_once(std::vector<std::string>& warnings, std::string warning) {
  if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end())
    warnings.push_back(std::move(warning));
}

fs::path shape_file(const std::string& key) {
  return ResponseCache::default_folder() / (key + ".shape");
}

Result<std::string> shape_key(const OrganGeometry& geometry, const fs::path& assets) {
  Hasher hasher;
  hasher.text("viscera shape").value(kShapeVersion);
  if (auto hashed = hash_geometry(hasher, geometry, assets); !hashed)
    return std::unexpected(hashed.error());
  return hasher.hex();
}

Result<PreparedShape> prepare_shape(const OrganDescription& organ, const PrepareOptions& options,
                                    std::vector<std::string>& warnings) {
  const Stopwatch watch;
  auto key = shape_key(organ.geometry, options.assets);
  if (!key) return std::unexpected(key.error());
  PreparedShape shape;
  shape.key = std::move(*key);
  const fs::path file = shape_file(shape.key);
  std::error_code ignored;
  if (options.use_cache && fs::exists(file, ignored)) {
    const auto read = read_shape(file, shape);
    shape.cache_hit = read.has_value();
    if (read)
      mark_used(file);
    else if (fs::exists(file, ignored))
      warnings.push_back(fmt::format("{}: cache {}: rebuilt because {}", organ.name, file.string(),
                                     read.error().text()));
  }
  if (!shape.cache_hit) {
    auto surface = build_shape(organ.geometry, options.assets, shape.notes);
    if (!surface) return std::unexpected(surface.error());
    shape.surface = std::move(*surface);
    if (options.use_cache)
      if (auto saved = write_shape(file, shape); !saved)
        warn_once(warnings, "cache not written: " + saved.error().text());
  }
  shape.seconds = watch.seconds();
  return shape;
}

}  // namespace viscera
