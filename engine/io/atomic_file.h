// Files that are whole or absent: written under a temporary name beside the final one, then
// renamed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// Whether a finished file must survive a power cut (fsync: milliseconds) or only a killed process.
enum class Durable { kNo, kYes };

/// "FILE: can't be written: No space left on device", with the missing folder named where that is
/// the reason.
Error write_error(const std::filesystem::path& file, int error_number);

/// The temporary name of a file in the making, for libraries and programs that write by name.
/// Removed with the object unless committed. A destination that exists and is a device or a pipe is
/// written in place.
class PendingFile {
 public:
  explicit PendingFile(std::filesystem::path file);
  ~PendingFile();
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&& other) noexcept;

  const std::filesystem::path& file() const { return file_; }
  const std::filesystem::path& temporary() const { return temporary_; }
  bool in_place() const { return temporary_ == file_; }

  /// Gives the file its final name, replacing an older one. Everything must be written and closed.
  Result<void> commit(Durable durable = Durable::kYes);

 private:
  void remove();
  std::filesystem::path file_, temporary_;  ///< temporary_ empty: committed or moved from
};

/// A buffered stream into a pending file. The first failure is kept and reported by commit(), so
/// that a loop may write without asking each time; what is written after it is lost.
class AtomicFile {
 public:
  /// Fails where the folder is missing or can't be written.
  static Result<AtomicFile> create(const std::filesystem::path& file);
  ~AtomicFile();
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;

  void write(std::string_view text) { write(text.data(), text.size()); }
  void write(const void* data, std::size_t size);
  bool failed() const { return error_ != 0; }
  /// The first failure so far.
  Result<void> status() const;
  /// All that was written so far, read back.
  Result<std::string> content();
  Result<void> commit(Durable durable = Durable::kYes);
  /// For a table, of which a part is better than nothing. What couldn't be written is tried once
  /// more, as a disk may have room again; where it still has none, the whole lines up to there take
  /// the file's name, and it fails all the same.
  Result<void> commit_lines(Durable durable = Durable::kYes);

 private:
  AtomicFile(PendingFile pending, int descriptor);
  void flush();

  PendingFile pending_;
  int descriptor_ = -1;
  int error_ = 0;  ///< errno of the first failure
  std::vector<char> buffer_;
};

/// The whole content in one go.
Result<void> write_file(const std::filesystem::path& file, std::string_view content,
                        Durable durable = Durable::kYes);

/// Creates the folder with its parents if need be and proves that files can be made in it.
Result<void> check_out_folder(const std::filesystem::path& folder);

}  // namespace viscera
