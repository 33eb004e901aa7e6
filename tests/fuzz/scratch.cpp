#include "tests/fuzz/scratch.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace viscera::fuzz {
namespace fs = std::filesystem;

fs::path scratch(const std::string& name, std::string_view bytes) {
  static const test::TemporaryFolder folder;
  const fs::path file = folder / name;
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

}  // namespace viscera::fuzz
