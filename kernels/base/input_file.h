// The one door for files that are read: what comes through it is a regular file of bounded size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "kernels/base/result.h"

namespace viscera {

/// A regular file, opened for reading. Neither a pipe nor a device is waited for.
class InputFile {
 public:
  /// `expected` ends the messages: "a surface". Fails where the path holds a NUL, or what it names,
  /// links followed, isn't a regular file, can't be opened or has more than `most` bytes.
  static Result<InputFile> open(const std::filesystem::path& file, std::string_view expected,
                                std::uintmax_t most);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  std::uintmax_t size() const { return size_; }  ///< when it was opened [bytes]
  /// The next bytes into `data`, as many as there are up to `size`; 0: the end.
  Result<std::size_t> read(void* data, std::size_t size);
  /// All bytes that are left. Fails where the file has become shorter since it was opened.
  Result<std::string> rest();

 private:
  InputFile(std::string name, int descriptor, std::uintmax_t size)
      : name_(std::move(name)), descriptor_(descriptor), size_(size) {}

  std::string name_;
  int descriptor_ = -1;
  std::uintmax_t size_ = 0, given_ = 0;
};

/// All of a file, as InputFile::open takes it.
Result<std::string> read_input(const std::filesystem::path& file, std::string_view expected,
                               std::uintmax_t most);

/// Where a file inside `folder` names another: that one's path. Fails where the name holds a NUL,
/// is absolute or, links followed, leads out of the folder; not where nothing is there.
Result<std::filesystem::path> path_inside(const std::filesystem::path& folder,
                                          const std::string& name);

}  // namespace viscera
