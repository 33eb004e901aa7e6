// Errors of set-up work (files, meshes, scenes, devices) are values, never exceptions.
#pragma once

#include <expected>
#include <string>
#include <utility>
#include <vector>

namespace viscera {

/// What went wrong, in words for the person who can mend it: every message says where, what was
/// found and what was expected. All mistakes found in one go are listed together.
struct Error {
  std::vector<std::string> messages;

  Error() = default;
  explicit Error(std::string message) : messages{std::move(message)} {}

  /// The messages, one a line.
  std::string text() const {
    std::string all;
    for (const std::string& message : messages) {
      if (!all.empty()) all += '\n';
      all += message;
    }
    return all;
  }
};

template <class T>
using Result = std::expected<T, Error>;

/// `return failure("liver.obj: expected ..., found ...");`
inline std::unexpected<Error> failure(std::string message) {
  return std::unexpected<Error>(Error(std::move(message)));
}

}  // namespace viscera
