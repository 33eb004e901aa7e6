// Files of others are read by a child process that may do nothing else: a crash there is an error
// message here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/archive.h"
#include "kernels/base/result.h"

namespace viscera {

/// What a child may use to read one file.
struct ReadLimits {
  std::uintmax_t memory = 0;  ///< that it allocates [bytes]
  double seconds = 0.0;       ///< of its processor
  std::uintmax_t answer = 0;  ///< [bytes]

  /// For a file of so many bytes: 256 MiB and 32 times the file, 2 s and 1 s a MiB.
  static ReadLimits for_file(std::uintmax_t bytes);
};

/// What is asked of the child: `reader` is a name of readers.h.
struct ReadRequest {
  std::string_view reader;
  std::filesystem::path file;
  std::vector<std::string> arguments = {};
  ReadLimits limits;
};

/// The child's answer as bytes, or its error. Fails where the child ends otherwise: by a signal,
/// out of memory or time; the message names the file.
Result<std::vector<std::byte>> ask_reader(const ReadRequest& request);

/// The same as a value, of which only the layout was checked.
template <class T>
Result<T> read_by_child(const ReadRequest& request) {
  const auto bytes = ask_reader(request);
  if (!bytes) return std::unexpected(bytes.error());
  T value;
  ByteReader reader(*bytes);
  read(reader, value);
  if (reader.failed() || !reader.at_end())
    return failure(request.file.string() + ": cannot be read: its reader's answer is damaged");
  return value;
}

/// The program that reads: viscera_reader. Sought, in this order: where the environment's
/// VISCERA_READER says, beside the running program, where this was installed, where it was built.
Result<std::filesystem::path> reader_program();

/// The child's side: writes an answer to descriptor `out`.
void give_answer(int out, const Result<std::vector<std::byte>>& answer);

}  // namespace viscera
