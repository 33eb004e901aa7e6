// Where a scene's geometry files are sought.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct GeometrySearch {
  std::filesystem::path scene_folder;
  std::vector<std::filesystem::path> extra;  ///< each with one level of its subfolders (--assets)
  std::filesystem::path assets;              ///< the project's
};

/// The folders in the order of search; subfolders by name.
std::vector<std::filesystem::path> search_folders(const GeometrySearch& search);

/// The first match. Refuses, in the form "found ..., expected ...": a format that isn't read, a
/// file that is in none of the folders (which are listed), and one that isn't a regular file.
Result<std::filesystem::path> find_geometry(const std::string& file, const GeometrySearch& search);

/// The same for a label map or a map of moduli: .nii, .nii.gz, .nrrd, .nhdr.
Result<std::filesystem::path> find_volume(const std::string& file, const GeometrySearch& search);

}  // namespace viscera
