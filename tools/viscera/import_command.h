// `viscera import`: label maps and surfaces to organs that scenes can use.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

struct ImportOptions {
  std::filesystem::path file;
  bool list = false;  ///< only say what the file holds
  bool all = false;   ///< every label
  std::vector<std::int32_t> labels;
  std::vector<std::string> names;   ///< of the organs, one a label; empty: the file's own
  std::filesystem::path out;        ///< folder
  std::string unit;                 ///< mm, cm, m; empty: the file's
  double edge = 0.0;                ///< of triangles [m]; 0: by the voxels
  double voxel = 0.0, close = 0.0;  ///< of wrapping [m]; 0: by the size
  std::string tissue;               ///< of the entries; empty: by the names
};

/// Writes NAME.obj (mm), NAME.json (the organ's entry for a scene), NAME_nodes.ply and NAME.html
/// for each organ, and prints their figures and warnings; or, with `list`, prints what the file
/// holds. Nothing is written unless everything can be. Files of that name that viscera didn't write
/// are left alone, which is a failure.
Result<void> import_file(const ImportOptions& options, const std::map<std::string, Tissue>& tissues,
                         std::ostream& out);

}  // namespace viscera
