// Surfaces for ParaView: VTK's XML files of unstructured grids (.vtu), and collections of them over
// time (.pvd).
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

/// Vectors at the points.
struct VtuField {
  std::string name;               ///< "displacement"
  std::span<const Vec3f> values;  ///< (points)
};

struct VtuSurface {
  std::span<const Vec3f> points;                  ///< [m]
  std::span<const std::array<int, 3>> triangles;  ///< indices of points
  std::vector<VtuField> fields;
};

/// Appended raw data, each array compressed by zlib. Not synced to the disk one by one: they are
/// many. Fails for fields that don't fit the points, a folder that is missing, a full disk.
Result<void> write_vtu(const std::filesystem::path& file, const VtuSurface& surface);

/// One part of the scene at one time. A file may stand for several times.
struct PvdEntry {
  double time = 0.0;  ///< [s]
  int part = 0;
  std::string name;  ///< of the part
  std::string file;  ///< relative to the collection
  static constexpr auto fields() {
    return std::tuple(field("time", &PvdEntry::time), field("part", &PvdEntry::part),
                      field("name", &PvdEntry::name), field("file", &PvdEntry::file));
  }
};
static_assert(fields_cover<PvdEntry>());

Result<void> write_pvd(const std::filesystem::path& file, std::span<const PvdEntry> entries);

}  // namespace viscera
