#include "tools/project_paths.h"

#include <cstdlib>

namespace viscera {
namespace fs = std::filesystem;

fs::path assets_folder() {
  if (const char* named = std::getenv("VISCERA_ASSETS")) return named;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path installed = program.parent_path().parent_path() / "share/viscera/assets";
    if (fs::exists(installed / "tissues.json")) return installed;
  }
  return fs::path(VISCERA_SOURCE_DIR) / "assets";
}

}  // namespace viscera
