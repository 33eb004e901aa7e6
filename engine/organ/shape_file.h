// The surface of an organ in the cache.
#pragma once

#include <filesystem>

#include "engine/io/cache_file.h"
#include "engine/organ/prepared_shape.h"
#include "kernels/base/result.h"

namespace viscera {

/// Fills surface and notes of the shape with this key. Fails, in words that complete "rebuilt
/// because", for a file that can't be used.
Result<void> read_shape(const std::filesystem::path& file, PreparedShape& shape);
Result<void> write_shape(const std::filesystem::path& file, const PreparedShape& shape);

/// What such a file holds.
Result<void> shape_of(CacheData data, PreparedShape& shape);

}  // namespace viscera
