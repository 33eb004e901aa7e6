#include "tools/common/project_paths.h"

#include <cstdlib>

namespace viscera {
namespace fs = std::filesystem;
namespace {

bool lies_in(const fs::path& file, const fs::path& folder) {
  const fs::path from_there = file.lexically_relative(folder);
  return !from_there.empty() && *from_there.begin() != "..";
}

fs::path program_file() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error);
}

bool is_built_here(const fs::path& program) {
  std::error_code error;
  return !program.empty() && lies_in(program, fs::weakly_canonical(VISCERA_BUILD_DIR, error));
}

}  // namespace

fs::path program_folder() {
  const fs::path program = program_file();
  return is_built_here(program) ? fs::path(VISCERA_BUILD_DIR) : program.parent_path();
}

fs::path assets_folder() {
  if (const char* named = std::getenv("VISCERA_ASSETS")) return named;
  const fs::path program = program_file();
  if (is_built_here(program)) return fs::path(VISCERA_SOURCE_DIR) / "assets";
  return (program.parent_path() / VISCERA_DATADIR / "viscera/assets").lexically_normal();
}

fs::path scenes_folder() {
  return (assets_folder() / "../scenes").lexically_normal();
}

}  // namespace viscera
