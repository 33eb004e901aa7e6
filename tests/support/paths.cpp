#include "tests/support/paths.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace viscera::test {
namespace fs = std::filesystem;

fs::path project_file(const std::string& path) {
  return fs::path(VISCERA_SOURCE_DIR) / path;
}

std::optional<fs::path> shared_data(const std::string& path) {
  const char* named = std::getenv("VISCERA_DATA");
  const fs::path root = named ? fs::path(named) : fs::path(VISCERA_SOURCE_DIR) / "../shared/data";
  const fs::path wanted = root / path;
  if (!fs::exists(wanted)) return std::nullopt;
  return wanted;
}

std::string file_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "viscera_test_XXXXXX").string();
  if (!mkdtemp(name.data())) std::abort();
  path_ = fs::canonical(name);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace viscera::test
