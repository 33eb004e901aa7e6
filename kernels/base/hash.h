// 128-bit content hashes (XXH3) for cache keys, checksums and the state hash of a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace viscera {

/// A running hash. Feed it values and arrays of plain numbers; the order counts.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  Hasher& bytes(const void* data, std::size_t size);
  Hasher& text(std::string_view value);  ///< length first, so that "ab","c" differs from "a","bc"

  template <class T>
  Hasher& value(const T& v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>, "hash plain numbers one by one");
    return bytes(&v, sizeof(T));
  }
  template <class T>
  Hasher& array(std::span<const T> values) {
    value<std::uint64_t>(values.size());
    return bytes(values.data(), values.size_bytes());
  }

  /// 32 hexadecimal digits.
  std::string hex() const;

  /// All that it has been fed, in as many bytes whatever that was, for restore() on a machine of
  /// this kind.
  std::vector<std::byte> save() const;
  /// False where these can't be such bytes; the hash is then as it was.
  bool restore(std::span<const std::byte> saved);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace viscera
