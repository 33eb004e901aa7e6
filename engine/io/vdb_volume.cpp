#include "engine/io/vdb_volume.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <span>
#include <spanstream>
#include <sstream>
#include <string_view>
#include <vector>

#include "kernels/base/hash.h"
#include "kernels/base/input_file.h"

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
    std::string all = std::move(out).str();
    // OpenVDB draws lots for an archive's identity. Made from the contents, the same smoke is the
    // same file.
    const std::string drawn = getUniqueTag();
    if (const std::size_t at = all.find(drawn); at != std::string::npos)
      all.replace(at, drawn.size(), identity_of(all.substr(at + drawn.size()), drawn.size()));
    return all;
  }

 private:
  /// As a UUID is written: 8-4-4-4-12 digits.
  static std::string identity_of(std::string_view contents, std::size_t size) {
    Hasher hasher;
    std::string text = hasher.bytes(contents.data(), contents.size()).hex();
    for (const std::size_t dash : {8u, 13u, 18u, 23u}) text.insert(dash, 1, '-');
    text.resize(size, '0');
    return text;
  }
};

// OpenVDB believes what a file says: of one that was cut or damaged it reads sizes from anywhere,
// and asks for that much memory. So a volume ends with a mark of ours behind its last grid, which
// readers of .vdb files don't look at: the length of what is before it and its hash.
constexpr std::uintmax_t kMostBytes = std::uintmax_t{4} << 30;
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

openvdb::math::Transform::Ptr cell_centres(const SmokeGrid& grid) {
  openvdb::math::Transform::Ptr transform =
      openvdb::math::Transform::createLinearTransform(grid.voxel);
  // A grid point is a cell centre.
  const Vec3 first =
      grid.domain.min() + grid.voxel * (Vec3::Constant(0.5) - grid.first.cast<double>());
  transform->postTranslate(openvdb::Vec3d(first.x(), first.y(), first.z()));
  return transform;
}

/// The leaves that hold smoke; most of a volume is empty, and costs a look at its density alone.
struct SmokyLeaves {
  static constexpr int kEdge = static_cast<int>(openvdb::FloatGrid::TreeType::LeafNodeType::DIM);
  std::vector<openvdb::Coord> origins;

  explicit SmokyLeaves(const SmokeGrid& grid) {
    const openvdb::Coord end(grid.first.x() + grid.size.x(), grid.first.y() + grid.size.y(),
                             grid.first.z() + grid.size.z());
    const auto start = [](int first) { return first & ~(kEdge - 1); };
    for (int z = start(grid.first.z()); z < end.z(); z += kEdge)
      for (int y = start(grid.first.y()); y < end.y(); y += kEdge)
        for (int x = start(grid.first.x()); x < end.x(); x += kEdge) {
          bool smoky = false;
          for_each_row(grid, {x, y, z}, [&](const openvdb::Coord&, std::size_t cell, int length) {
            for (int i = 0; i < length; ++i) smoky |= has_smoke(grid, cell + i);
          });
          if (smoky) origins.emplace_back(x, y, z);
        }
  }

  static bool has_smoke(const SmokeGrid& grid, std::size_t cell) {
    return !(grid.density[cell] <= kLeastDensity);
  }

  /// Calls row(first place, its cell, length) for what lies of each row along x of a leaf in the
  /// grid.
  template <class Row>
  static void for_each_row(const SmokeGrid& grid, const openvdb::Coord& origin, const Row& row) {
    const auto first = [&](int axis) { return std::max(origin[axis], grid.first[axis]); };
    const auto end = [&](int axis) {
      return std::min(origin[axis] + kEdge, grid.first[axis] + grid.size[axis]);
    };
    for (int z = first(2); z < end(2); ++z)
      for (int y = first(1); y < end(1); ++y) {
        const std::size_t line =
            static_cast<std::size_t>(y - grid.first.y()) +
            static_cast<std::size_t>(grid.size.y()) * static_cast<std::size_t>(z - grid.first.z());
        row(openvdb::Coord(first(0), y, z),
            static_cast<std::size_t>(first(0) - grid.first.x()) +
                static_cast<std::size_t>(grid.size.x()) * line,
            end(0) - first(0));
      }
  }
};

bool within(float value, float least) {
  return std::abs(value) <= least;
}
bool within(const openvdb::Vec3s& value, float least) {
  return within(value.x(), least) && within(value.y(), least) && within(value.z(), least);
}

/// `value_at`(cell) where there is smoke; what is within `least` of zero is left out.
template <class Grid, class ValueAt>
typename Grid::Ptr sparse_grid(const std::string& name, const std::string& unit,
                               const SmokeGrid& grid, const SmokyLeaves& leaves, float least,
                               const ValueAt& value_at) {
  using Value = typename Grid::ValueType;
  using Leaf = typename Grid::TreeType::LeafNodeType;
  constexpr openvdb::Index kAlongX = 1 << 2 * Leaf::LOG2DIM;  // from a value of a leaf to the next
  typename Grid::Ptr sparse = Grid::create(openvdb::zeroVal<Value>());
  for (const openvdb::Coord& origin : leaves.origins) {
    Leaf* leaf = nullptr;
    Value* values = nullptr;
    SmokyLeaves::for_each_row(
        grid, origin, [&](const openvdb::Coord& first, std::size_t cell, int length) {
          const openvdb::Index begin = Leaf::coordToOffset(first);
          for (int i = 0; i < length; ++i) {
            if (!SmokyLeaves::has_smoke(grid, cell + i)) continue;
            const Value value = value_at(cell + i);
            if (within(value, least)) continue;
            if (leaf == nullptr) {
              leaf = sparse->tree().touchLeaf(origin);
              values = leaf->buffer().data();
            }
            const openvdb::Index at = begin + static_cast<openvdb::Index>(i) * kAlongX;
            values[at] = value;
            leaf->setActiveState(at, true);
          }
        });
  }
  sparse->setName(name);
  sparse->setSaveFloatAsHalf(true);
  sparse->insertMeta("unit", openvdb::StringMetadata(unit));
  sparse->setTransform(cell_centres(grid));
  return sparse;
}

openvdb::FloatGrid::Ptr fog_volume(const std::string& name, const std::string& unit,
                                   const SmokeGrid& grid, const SmokyLeaves& leaves,
                                   const std::vector<float>& values, float least) {
  auto volume = sparse_grid<openvdb::FloatGrid>(name, unit, grid, leaves, least,
                                                [&](std::size_t cell) { return values[cell]; });
  volume->setGridClass(openvdb::GRID_FOG_VOLUME);
  return volume;
}

openvdb::Vec3SGrid::Ptr velocity_grid(const SmokeGrid& grid, const SmokyLeaves& leaves) {
  auto velocity = sparse_grid<openvdb::Vec3SGrid>("velocity", "m/s", grid, leaves, kLeastVelocity,
                                                  [&](std::size_t cell) {
                                                    const Vec3f& v = grid.velocity[cell];
                                                    return openvdb::Vec3s(v.x(), v.y(), v.z());
                                                  });
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
    // Where there is no smoke to see, its temperature and velocity mean nothing.
    const SmokyLeaves leaves(grid);
    const openvdb::GridCPtrVec grids = {
        fog_volume("density", "kg/m3", grid, leaves, grid.density, kLeastDensity),
        fog_volume("temperature", "K above the gas", grid, leaves, grid.temperature,
                   kLeastTemperature),
        velocity_grid(grid, leaves)};
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

Result<SmokeFileInfo> read_smoke_info_here(const std::filesystem::path& file) {
  const std::string where = file.string() + ": ";
  auto bytes = read_input(file, "a .vdb file", kMostBytes);
  if (!bytes) return std::unexpected(bytes.error());
  try {
    if (const std::string found = damage(*bytes); !found.empty()) return failure(where + found);
    ensure_openvdb();
    // OpenVDB doesn't look whether there was anything to read, and makes as many tiles as a file
    // says though it has ended: a stream that throws at its end stops it there.
    std::ispanstream stream(std::span<char>(*bytes), std::ios::in | std::ios::binary);
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    openvdb::io::Stream archive(stream, /*delayLoad=*/false);

    SmokeFileInfo info;
    openvdb::GridBase::Ptr named_density;
    for (const openvdb::GridBase::Ptr& grid : *archive.getGrids()) {
      if (grid->getName() == "density") named_density = grid;
      const auto unit = grid->getMetadata<openvdb::StringMetadata>("unit");
      info.grids.push_back({grid->getName(), grid->valueType(), unit ? unit->value() : ""});
    }
    std::ranges::sort(info.grids, {}, &SmokeFileInfo::Grid::name);
    if (!named_density) {
      return failure(where + "no grid named density, expected a smoke volume");
    }
    const auto density = openvdb::gridPtrCast<openvdb::FloatGrid>(named_density);
    if (!density) {
      return failure(where + "the grid density doesn't hold floats, expected a smoke volume");
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
    const openvdb::CoordBBox active = density->evalActiveVoxelBoundingBox();
    if (info.active_voxels > 0) {
      Box bounds;
      for (const openvdb::Coord& corner : {active.min(), active.max()}) {
        const openvdb::Vec3d centre = density->indexToWorld(corner);
        const Vec3 at(centre.x(), centre.y(), centre.z());
        bounds.extend(Vec3(at.array() - 0.5 * info.voxel));
        bounds.extend(Vec3(at.array() + 0.5 * info.voxel));
      }
      info.least = bounds.min();
      info.greatest = bounds.max();
    }
    if (!std::isfinite(info.mass) || !info.least.allFinite() || !info.greatest.allFinite())
      return failure(where + "damaged: the density isn't finite");
    return info;
  } catch (const std::exception& error) {
    return failure(where + "not a whole .vdb file: " + error.what());
  }
}

}  // namespace viscera
