// NRRD volumes ("nearly raw raster data"; the format's definition is teem's), with attached
// (.nrrd) or detached (.nhdr) voxels, raw or gzip.
#pragma once

#include <filesystem>

#include "engine/io/label_volume.h"

namespace viscera {

/// Spaces: right- or left-anterior-superior and left-posterior-superior, with space directions.
/// Names of labels from the keys of 3D Slicer's segmentations (SegmentN_Name, SegmentN_LabelValue).
/// Messages open with the file.
Result<LabelVolume> read_nrrd(const std::filesystem::path& file);

}  // namespace viscera
