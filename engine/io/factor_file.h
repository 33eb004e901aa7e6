// The factor of a prepared organ, in the cache beside what was made of it.
#pragma once

#include <filesystem>
#include <string>

#include "engine/io/cache_file.h"
#include "kernels/base/result.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {

/// Overwrites. Fails where it can't be written.
Result<void> write_factor(const std::filesystem::path& file, const std::string& key,
                          const StiffnessFactor& factor);

/// Fails, in words that complete "rebuilt because", for a file that isn't there, is damaged or
/// foreign, or holds what no factor can be.
Result<StiffnessFactor> read_factor(const std::filesystem::path& file, const std::string& key);

/// What such a file holds.
Result<StiffnessFactor> factor_of(CacheData data);

}  // namespace viscera
