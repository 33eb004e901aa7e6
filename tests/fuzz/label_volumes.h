// What the targets of label maps share.
#pragma once

#include <filesystem>

#include "engine/io/label_volume.h"
#include "tests/support/label_files.h"

namespace viscera::fuzz {

/// Some voxels of two labels.
test::LabelImage small_image();

/// What the program makes of a volume that its reader has handed over.
bool is_label_map(const std::filesystem::path& file, Result<LabelVolume> volume);

}  // namespace viscera::fuzz
