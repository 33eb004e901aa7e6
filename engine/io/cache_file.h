// Named arrays and texts in an HDF5 file with a checksum over everything: the store under every
// cache.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// What is to be written: views, so that nothing of hundreds of megabytes is copied. Names are used
/// once and hold no '/'.
class CacheContents {
 public:
  using View = std::variant<std::span<const double>, std::span<const float>, std::span<const int>>;

  void text(const std::string& name, std::string value) { texts_[name] = std::move(value); }
  /// `values` must stay until the file is written.
  void array(const std::string& name, View values) { arrays_[name] = values; }
  template <class T>
  void array(const std::string& name, const std::vector<T>& values) {
    array(name, View(std::span<const T>(values)));
  }

  const std::map<std::string, std::string>& texts() const { return texts_; }
  const std::map<std::string, View>& arrays() const { return arrays_; }

 private:
  std::map<std::string, std::string> texts_;
  std::map<std::string, View> arrays_;
};

/// What was read; its checksum has been verified.
class CacheData {
 public:
  using Array = std::variant<std::vector<double>, std::vector<float>, std::vector<int>>;

  Result<std::string> text(const std::string& name) const;
  /// Moves an array out; fails when there is none of that name, number type and size.
  template <class T>
  Result<std::vector<T>> take(const std::string& name) {
    const auto found = arrays_.find(name);
    if (found == arrays_.end()) return failure("the array " + name + " is missing");
    auto* values = std::get_if<std::vector<T>>(&found->second);
    if (!values) return failure("the array " + name + " holds another type of number");
    return std::move(*values);
  }
  template <class T>
  Result<std::vector<T>> take(const std::string& name, std::size_t size) {
    auto values = take<T>(name);
    if (values && values->size() != size) {
      return failure("the array " + name + " holds " + std::to_string(values->size()) +
                     " values, expected " + std::to_string(size));
    }
    return values;
  }

  std::map<std::string, std::string>& texts() { return texts_; }
  std::map<std::string, Array>& arrays() { return arrays_; }

 private:
  std::map<std::string, std::string> texts_;
  std::map<std::string, Array> arrays_;
};

/// Contiguous, page-aligned datasets and attributes `format` and `key`; before them, in HDF5's user
/// block, the XXH3-128 of all that follows, so that a damaged file is known before HDF5 parses it.
/// Written to a temporary name; a full disk leaves nothing.
Result<void> write_cache_file(const std::filesystem::path& file, int format, const std::string& key,
                              const CacheContents& contents);

/// Fails, in words that complete "rebuilt because ...", for a file that can't be read, is foreign
/// or damaged, or has another format or key.
Result<CacheData> read_cache_file(const std::filesystem::path& file, int format,
                                  const std::string& key);

}  // namespace viscera
