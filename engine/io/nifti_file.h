// NIfTI-1 volumes [Cox2004], header and voxels in one file (.nii, .nii.gz).
#pragma once

#include <filesystem>

#include "engine/io/label_volume.h"

namespace viscera {

/// Either byte order; values scaled by scl_slope and scl_inter; orientation from sform, or qform
/// where that isn't set; names of labels from a Caret extension. Messages open with the file.
Result<LabelVolume> read_nifti(const std::filesystem::path& file);

}  // namespace viscera
