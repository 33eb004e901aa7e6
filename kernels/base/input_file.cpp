#include "kernels/base/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace viscera {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) {
  return std::generic_category().message(error);
}

bool has_nul(const std::string& name) {
  return name.find('\0') != std::string::npos;
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

}  // namespace

Result<InputFile> InputFile::open(const fs::path& file, std::string_view expected,
                                  std::uintmax_t most) {
  const std::string name = file.string();
  const auto refused = [&](const std::string& found) {
    return failure(name + ": found " + found + ", expected " + std::string(expected));
  };
  if (name.empty()) return refused("no name");
  if (has_nul(name)) return refused("a NUL in the file's name");
  // O_NONBLOCK: opening a pipe that nobody writes to would wait.
  const int descriptor = ::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return refused("no such file");
    return failure(name + ": cannot be read: " + reason(errno));
  }
  InputFile input(name, descriptor, 0);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0)
    return failure(name + ": cannot be read: " + reason(errno));
  if (S_ISDIR(status.st_mode)) return refused("a folder");
  if (!S_ISREG(status.st_mode)) return refused("something other than a regular file");
  input.size_ = static_cast<std::uintmax_t>(status.st_size);
  if (input.size_ > most)
    return failure(name + ": found " + std::to_string(input.size_) + " bytes, expected at most " +
                   std::to_string(most));
  return input;
}

InputFile::InputFile(InputFile&& other) noexcept
    : name_(std::move(other.name_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      given_(other.given_) {}

InputFile& InputFile::operator=(InputFile&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  std::swap(given_, other.given_);
  return *this;
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<std::size_t> InputFile::read(void* data, std::size_t size) {
  auto* bytes = static_cast<char*>(data);
  std::size_t got = 0;
  while (got < size) {
    const ssize_t more = ::read(descriptor_, bytes + got, size - got);
    if (more < 0 && errno == EINTR) continue;
    if (more < 0) return failure(name_ + ": cannot be read: " + reason(errno));
    if (more == 0) break;
    got += static_cast<std::size_t>(more);
  }
  given_ += got;
  return got;
}

Result<std::string> InputFile::rest() {
  // What somebody adds meanwhile isn't read: the size was held against its limit.
  std::string bytes(static_cast<std::size_t>(size_ - std::min(size_, given_)), '\0');
  const auto got = read(bytes.data(), bytes.size());
  if (!got) return std::unexpected(got.error());
  if (*got < bytes.size())
    return failure(name_ + ": found its end after " + std::to_string(given_) + " bytes, expected " +
                   std::to_string(size_) + ": it is being written");
  return bytes;
}

Result<std::string> read_input(const fs::path& file, std::string_view expected,
                               std::uintmax_t most) {
  auto input = InputFile::open(file, expected, most);
  if (!input) return std::unexpected(input.error());
  return input->rest();
}

Result<fs::path> path_inside(const fs::path& folder, const std::string& name) {
  const auto refused = [&](const std::string& found) {
    return failure("found " + found + ", expected the name of a file in " + folder.string());
  };
  if (has_nul(name)) return refused("a NUL in a file's name");
  if (name.empty()) return refused("no name");
  if (fs::path(name).is_absolute()) return refused("the absolute path " + name);
  std::error_code failed;
  const fs::path root = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, failed);
  if (failed) return refused(name + " in a folder that cannot be read");
  const fs::path target = fs::weakly_canonical(root / name, failed);
  if (failed || !lies_in(target, root)) return refused(name);
  return target;
}

}  // namespace viscera
