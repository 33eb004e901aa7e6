#include "engine/io/smoke_file.h"

#include <algorithm>

#include "engine/io/atomic_file.h"
#include "engine/io/vdb_volume.h"

namespace viscera {
namespace {

Result<void> write_volume(const std::filesystem::path& file, const SmokeGrid& grid, double time,
                          const std::string& volume, const std::string& scene) {
  const Result<std::string> bytes = encode_volume(grid, time, volume, scene);
  if (!bytes) return failure(file.string() + ": " + bytes.error().text());
  return write_file(file, *bytes, Durable::kNo);
}

}  // namespace

SmokeWriter::SmokeWriter() {
  ensure_openvdb();
}

void SmokeWriter::write(const std::filesystem::path& file, const SmokeGrid& grid, double time,
                        const std::string& volume_name, const std::string& scene_name) {
  // A grid that doesn't fit together is refused when it is encoded.
  const auto cells = static_cast<std::size_t>(std::max(0, grid.size.prod()));
  const bool fits = cells > 0 && grid.density.size() == cells && grid.temperature.size() == cells &&
                    grid.velocity.size() == cells;
  worker_.add([file, part = fits ? filled_part(grid) : grid, time, volume_name, scene_name] {
    return write_volume(file, part, time, volume_name, scene_name);
  });
}

}  // namespace viscera
