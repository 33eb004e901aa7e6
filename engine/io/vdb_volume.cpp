#include "engine/io/vdb_volume.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <sstream>
#include <string_view>

#include "kernels/base/hash.h"

namespace viscera {
namespace {

// Half precision's least positive value: what is less would be stored as zero.
constexpr float kLeastDensity = 0x1p-24f;
constexpr float kLeastTemperature = 0.05f;
constexpr float kLeastVelocity = 1e-5f;

std::atomic<int> initialisations = 0;

// io::File opens its file itself and doesn't look whether the bytes arrived. This writes the same
// seekable archive to memory, so that the file is written, and checked, like all our others.
class MemoryArchive : public openvdb::io::Archive {
 public:
  // Leaving out inactive voxels is the whole gain: Blosc took twice the time to shrink a plume of
  // 530,000 voxels by not one per cent more, zlib ten times.
  MemoryArchive() { setCompression(openvdb::io::COMPRESS_ACTIVE_MASK); }

  std::string bytes(const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) const {
    std::ostringstream out(std::ios::binary);
    Archive::write(out, grids, /*seekable=*/true, metadata);
    return std::move(out).str();
  }
};

// OpenVDB believes what a file says: of one that was cut or damaged it reads sizes from anywhere,
// and asks for that much memory. So a volume ends with a mark of ours behind its last grid, which
// readers of .vdb files don't look at: the length of what is before it and its hash.
constexpr std::string_view kMark = "viscera whole ";
constexpr std::size_t kLengthDigits = 16, kHashDigits = 32;
constexpr std::size_t kMarkBytes = kMark.size() + kLengthDigits + 1 + kHashDigits + 1;

std::string end_mark(std::string_view bytes) {
  char length[kLengthDigits + 1];
  std::snprintf(length, sizeof length, "%016zx", bytes.size());
  Hasher hasher;
  hasher.bytes(bytes.data(), bytes.size());
  return std::string(kMark) + length + ' ' + hasher.hex() + '\n';
}

/// Why this isn't a volume as encode_volume() made it; empty: it is.
std::string damage(std::string_view bytes) {
  if (bytes.size() < kMarkBytes || !bytes.substr(bytes.size() - kMarkBytes).starts_with(kMark)) {
    return "cut off: found no end mark in its " + std::to_string(bytes.size()) +
           " bytes, expected a whole .vdb volume that viscera wrote";
  }
  const std::string_view volume = bytes.substr(0, bytes.size() - kMarkBytes);
  if (bytes.substr(volume.size()) == end_mark(volume)) return "";
  return "damaged: found bytes that differ from those written, expected a whole volume that "
         "viscera wrote";
}

Result<std::string> read_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes(std::filesystem::file_size(file), '\0');
  if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    return failure("can't be read");
  }
  return bytes;
}

openvdb::math::Transform::Ptr cell_centres(const SmokeGrid& grid) {
  openvdb::math::Transform::Ptr transform =
      openvdb::math::Transform::createLinearTransform(grid.voxel);
  // A grid point is a cell centre.
  const Vec3 first =
      grid.domain.min() + grid.voxel * (Vec3::Constant(0.5) - grid.first.cast<double>());
  transform->postTranslate(openvdb::Vec3d(first.x(), first.y(), first.z()));
  return transform;
}

/// `values`: of all cells, x fastest; those within `least` of zero are left out.
template <class Grid>
typename Grid::Ptr sparse_grid(const std::string& name, const std::string& unit,
                               const SmokeGrid& grid, const typename Grid::ValueType* values,
                               const typename Grid::ValueType& least) {
  using Value = typename Grid::ValueType;
  const openvdb::Coord first(grid.first.x(), grid.first.y(), grid.first.z());
  const openvdb::CoordBBox bounds(
      first, first.offsetBy(grid.size.x() - 1, grid.size.y() - 1, grid.size.z() - 1));
  const openvdb::tools::Dense<const Value, openvdb::tools::LayoutXYZ> dense(bounds, values);
  typename Grid::Ptr sparse = Grid::create(openvdb::zeroVal<Value>());
  // Serial: this runs beside the frames, whose threads it shouldn't take.
  openvdb::tools::copyFromDense(dense, *sparse, least, /*serial=*/true);
  sparse->setName(name);
  sparse->setSaveFloatAsHalf(true);
  sparse->insertMeta("unit", openvdb::StringMetadata(unit));
  sparse->setTransform(cell_centres(grid));
  return sparse;
}

openvdb::FloatGrid::Ptr fog_volume(const std::string& name, const std::string& unit,
                                   const SmokeGrid& grid, const std::vector<float>& values,
                                   float least) {
  auto volume = sparse_grid<openvdb::FloatGrid>(name, unit, grid, values.data(), least);
  volume->setGridClass(openvdb::GRID_FOG_VOLUME);
  return volume;
}

openvdb::Vec3SGrid::Ptr velocity_grid(const SmokeGrid& grid) {
  std::vector<openvdb::Vec3s> values(grid.velocity.size(), openvdb::Vec3s(0.0f));
  for (std::size_t c = 0; c < values.size(); ++c)
    if (grid.density[c] > kLeastDensity)
      values[c] = openvdb::Vec3s(grid.velocity[c].x(), grid.velocity[c].y(), grid.velocity[c].z());
  auto velocity = sparse_grid<openvdb::Vec3SGrid>("velocity", "m/s", grid, values.data(),
                                                  openvdb::Vec3s(kLeastVelocity));
  velocity->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  return velocity;
}

}  // namespace

void ensure_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] {
    openvdb::initialize();
    ++initialisations;
  });
}

int openvdb_initialisations() {
  return initialisations;
}

Result<std::string> encode_volume(const SmokeGrid& grid, double time,
                                  const std::string& volume_name, const std::string& scene_name) {
  const std::size_t cells = grid.size.minCoeff() > 0 ? static_cast<std::size_t>(grid.size.x()) *
                                                           grid.size.y() * grid.size.z()
                                                     : 0;
  if (cells == 0 || !(grid.voxel > 0.0) || grid.density.size() != cells ||
      grid.temperature.size() != cells || grid.velocity.size() != cells) {
    return failure("smoke grid of " + std::to_string(cells) + " cells: found " +
                   std::to_string(grid.density.size()) + " densities, " +
                   std::to_string(grid.temperature.size()) + " temperatures and " +
                   std::to_string(grid.velocity.size()) +
                   " velocities, expected one of each a cell, and a positive voxel");
  }
  try {
    ensure_openvdb();
    // Where there is no smoke to see, its temperature means nothing.
    std::vector<float> temperature = grid.temperature;
    for (std::size_t c = 0; c < cells; ++c) {
      if (grid.density[c] <= kLeastDensity) temperature[c] = 0.0f;
    }
    const openvdb::GridCPtrVec grids = {
        fog_volume("density", "kg/m3", grid, grid.density, kLeastDensity),
        fog_volume("temperature", "K above the gas", grid, temperature, kLeastTemperature),
        velocity_grid(grid)};
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("viscera"));
    metadata.insertMeta("scene", openvdb::StringMetadata(scene_name));
    metadata.insertMeta("volume", openvdb::StringMetadata(volume_name));
    metadata.insertMeta("time_s", openvdb::DoubleMetadata(time));
    metadata.insertMeta("length_unit", openvdb::StringMetadata("m"));
    std::string bytes = MemoryArchive().bytes(grids, metadata);
    bytes += end_mark(bytes);
    return bytes;
  } catch (const std::exception& error) {
    return failure(std::string("OpenVDB: ") + error.what());
  }
}

Result<SmokeFileInfo> read_smoke_info(const std::filesystem::path& file) {
  const std::string where = file.string() + ": ";
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return failure(where + "not found, expected a .vdb file");
  }
  try {
    const Result<std::string> bytes = read_bytes(file);
    if (!bytes) return failure(where + bytes.error().text());
    if (const std::string found = damage(*bytes); !found.empty()) return failure(where + found);
    ensure_openvdb();
    openvdb::io::File archive(file.string());
    archive.setCopyMaxBytes(0);
    archive.open(/*delayLoad=*/false);
    if (!archive.hasGrid("density")) {
      return failure(where + "no grid named density, expected a smoke volume");
    }
    const auto density = openvdb::gridPtrCast<openvdb::FloatGrid>(archive.readGrid("density"));
    if (!density) {
      return failure(where + "the grid density doesn't hold floats, expected a smoke volume");
    }

    SmokeFileInfo info;
    for (auto name = archive.beginName(); name != archive.endName(); ++name) {
      const openvdb::GridBase::Ptr grid = archive.readGridMetadata(*name);
      const auto unit = grid->getMetadata<openvdb::StringMetadata>("unit");
      info.grids.push_back({*name, grid->valueType(), unit ? unit->value() : ""});
    }
    const openvdb::MetaMap::Ptr metadata = archive.getMetadata();
    if (const auto volume = metadata->getMetadata<openvdb::StringMetadata>("volume")) {
      info.volume = volume->value();
    }
    if (const auto time = metadata->getMetadata<openvdb::DoubleMetadata>("time_s")) {
      info.time = time->value();
    }
    info.voxel = density->voxelSize().x();
    info.active_voxels = density->activeVoxelCount();
    double sum = 0.0;
    for (auto value = density->cbeginValueOn(); value; ++value) {
      sum += static_cast<double>(*value) * static_cast<double>(value.getVoxelCount());
    }
    info.mass = sum * std::pow(info.voxel, 3);
    const openvdb::CoordBBox bounds = density->evalActiveVoxelBoundingBox();
    if (info.active_voxels > 0) {
      for (const openvdb::Coord& corner : {bounds.min(), bounds.max()}) {
        const openvdb::Vec3d centre = density->indexToWorld(corner);
        const Vec3 at(centre.x(), centre.y(), centre.z());
        info.active_bounds.extend(Vec3(at.array() - 0.5 * info.voxel));
        info.active_bounds.extend(Vec3(at.array() + 0.5 * info.voxel));
      }
    }
    if (!std::isfinite(info.mass)) return failure(where + "damaged: the density isn't finite");
    return info;
  } catch (const std::exception& error) {
    return failure(where + "not a whole .vdb file: " + error.what());
  }
}

}  // namespace viscera
