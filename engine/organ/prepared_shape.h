// The surface of an organ, from the cache where it lies there. Kept apart from the organ's
// elasticity: what is prepared depends on where the surface lies, so that is known first; and an
// organ that nothing touches is nothing else.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/scene.h"
#include "kernels/base/hash.h"
#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Where all columns of an organ's compliance take no more than this, they are made at preparation;
/// above it, those of the fine part, and the others when they are asked for. Chosen: 1,885 places,
/// more than the recipes' organs have in shipped scenes, and their products take seconds [bytes].
inline constexpr std::size_t kColumnBudget = 128'000'000;

struct PrepareOptions {
  std::filesystem::path assets;
  bool use_cache = true;
  std::size_t column_budget = kColumnBudget;  ///< [bytes]
  /// What factoring an organ may take beside what is kept [bytes].
  std::size_t most_memory = std::numeric_limits<std::size_t>::max();
};

struct PreparedShape {
  TriangleSurface surface;
  std::vector<std::string> notes;  ///< how a wrapped surface differs from its file
  std::string key;                 ///< of the cache: a hash of everything that makes the surface
  double seconds = 0.0;            ///< it took
  bool cache_hit = false;
};

/// Loads the surface from the cache, or builds and stores it. `warnings` gets what a person should
/// know (a broken file that was rebuilt, one that could not be written). Fails as build_shape does.
Result<PreparedShape> prepare_shape(const OrganDescription& organ, const PrepareOptions& options,
                                    std::vector<std::string>& warnings);

/// Adds a file's bytes; fails, saying what was `expected`, where it can't be read.
Result<void> hash_file(Hasher& hasher, const std::filesystem::path& file,
                       std::string_view expected);

/// Said once, however many files of a cache share the reason.
void warn_once(std::vector<std::string>& warnings, std::string warning);

/// Where the cache keeps the surface of that key.
std::filesystem::path shape_file(const std::string& key);

/// The key alone. Fails for files that can't be read.
Result<std::string> shape_key(const OrganGeometry& geometry, const std::filesystem::path& assets);

}  // namespace viscera
