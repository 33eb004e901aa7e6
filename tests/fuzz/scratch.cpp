#include "tests/fuzz/scratch.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace viscera::fuzz {
namespace {

namespace fs = std::filesystem;

struct Folder {
  fs::path path;
  pid_t owner = ::getpid();
  Folder() {
    std::string name = (fs::temp_directory_path() / "viscera_fuzz_XXXXXX").string();
    if (!::mkdtemp(name.data())) {
      std::perror(name.c_str());
      std::abort();
    }
    path = fs::canonical(name);
  }
  ~Folder() {
    std::error_code ignored;
    if (owner == ::getpid()) fs::remove_all(path, ignored);
  }
};

}  // namespace

fs::path scratch(const std::string& name, std::string_view bytes) {
  static const Folder folder;
  const fs::path file = folder.path / name;
  constexpr int kHow = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
  int out = ::open(file.c_str(), kHow, 0600);
  if (out < 0 && errno == ENOENT) {
    fs::create_directories(file.parent_path());
    out = ::open(file.c_str(), kHow, 0600);
  }
  const bool written =
      out >= 0 && ::write(out, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
  if (!written) {
    std::perror(file.c_str());
    std::abort();
  }
  ::close(out);
  return file;
}

fs::path project_file(const std::string& path) {
  return fs::path(VISCERA_SOURCE_DIR) / path;
}

std::string bytes_of_file(const fs::path& file) {
  std::ostringstream all;
  all << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(all).str();
}

}  // namespace viscera::fuzz
