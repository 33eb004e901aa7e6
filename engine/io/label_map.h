// Label maps: volumes of voxels that each carry the number of the organ they belong to, as
// segmentation programs write them. NIfTI-1 [Cox2004] and NRRD.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/label_volume.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

/// Positions are in the body's frame of a scene: x to the patient's left, y to the head, z to the
/// front [m]; its origin is the file's. A voxel of label 0 is background.
struct LabelMap {
  std::filesystem::path file;
  std::string format;                     ///< "NIfTI-1", "NRRD"
  Eigen::Vector3i size;                   ///< voxels along i, j, k, (3)
  std::vector<std::int32_t> labels;       ///< (size.x size.y size.z), i fastest
  Mat3 axes;                              ///< columns: the steps of i, j and k, orthogonal [m]
  Vec3 origin;                            ///< centre of voxel (0, 0, 0) [m]
  double unit = 0.0;                      ///< metres per unit of the file
  bool unit_assumed = false;              ///< neither the file nor the caller said it
  std::optional<double> unit_overridden;  ///< what the file said, where the caller said otherwise
  std::map<std::int32_t, std::string> names;  ///< of labels, where the file tells them

  Vec3 spacing() const { return axes.colwise().norm(); }                  ///< [m]
  double voxel_volume() const { return spacing().prod(); }                ///< [m3]
  Vec3 centre(const Vec3& index) const { return origin + axes * index; }  ///< [m]
  std::size_t voxels() const { return labels.size(); }
  std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * size.y() + j) * size.x() + i;
  }
  /// Where i, j and k run to, by the nearest axis: "RAS", "LPS", ...
  std::string orientation() const;
};

struct LabelMapOptions {
  std::optional<double> unit;     ///< metres per unit, in place of what the file says
  std::optional<double> assumed;  ///< metres per unit where neither says; none: refused
  /// Different ones; where more are found, it is taken for an image.
  std::size_t most_values = 1000;
};

/// Reads .nii, .nii.gz, .nrrd or .nhdr. Refused, each with the reason: other formats, truncated and
/// damaged files, more or fewer than three dimensions, colours, values that aren't whole numbers,
/// more than `most_values` different labels (an image, not a label map), no orientation, axes that
/// aren't at right angles, unknown units, and units that make the volume shorter than 5 mm or
/// longer than 3 m (with the unit that would fit).
Result<LabelMap> read_label_map(const std::filesystem::path& file, const LabelMapOptions& options);

/// What read_label_map() makes of the volume that it was handed; its indices and sizes are sound.
Result<LabelMap> label_map_of(const std::filesystem::path& file, LabelVolume volume,
                              const LabelMapOptions& options);

/// The volume alone. In this process, which a damaged file may end: read_label_map() asks another.
Result<LabelVolume> read_label_volume_here(const std::filesystem::path& file);

/// Whether the file's name ends as one of the formats that read_label_map() reads.
bool is_label_map_file(const std::filesystem::path& file);

/// What a label occupies.
struct LabelExtent {
  std::size_t voxels = 0;
  Eigen::Vector3i first, last;  ///< least and greatest indices, both inclusive
};

/// Every label but the background, by number.
std::map<std::int32_t, LabelExtent> label_extents(const LabelMap& map);

/// The box around the voxels of an extent [m].
Box box_of(const LabelMap& map, const LabelExtent& extent);

}  // namespace viscera
