// What follows from the declaration of a struct's fields (fields.h): save, load, hash, memory
// count, the first difference between two values, and the signature of a layout.
//
// Numbers are written as this machine has them, so a file is for machines of one kind. Reading
// trusts nothing: counts are held against the bytes that are left.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "kernels/base/fields.h"
#include "kernels/base/hash.h"

namespace viscera {

/// Takes bytes into memory.
class ByteWriter {
 public:
  ByteWriter() = default;
  /// Takes over memory that isn't needed any more.
  explicit ByteWriter(std::vector<std::byte> memory) : all_(std::move(memory)) { all_.clear(); }
  void bytes(const void* data, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(data);
    all_.insert(all_.end(), begin, begin + size);
  }
  void reserve(std::size_t size) { all_.reserve(size); }
  std::vector<std::byte> take() { return std::move(all_); }

 private:
  std::vector<std::byte> all_;
};

/// Counts them.
class ByteCounter {
 public:
  void bytes(const void*, std::size_t size) { count_ += size; }
  std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
};

/// Gives them back. After the first thing that doesn't fit nothing is read any more.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> all) : left_(all) {}
  bool bytes(void* data, std::size_t size) {
    if (failed_ || size > left_.size()) return fail();
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_ = left_.subspan(size);
    return true;
  }
  /// A count of things of at least so many bytes each.
  std::size_t count(std::size_t least) {
    std::uint64_t n = 0;
    if (!bytes(&n, sizeof n) || n > left_.size() / std::max<std::size_t>(1, least)) {
      fail();
      return 0;
    }
    return static_cast<std::size_t>(n);
  }
  bool fail() {
    failed_ = true;
    return false;
  }
  bool holds(std::uint64_t count, std::size_t each) const { return count <= left_.size() / each; }
  bool failed() const { return failed_; }
  bool at_end() const { return left_.empty(); }

 private:
  std::span<const std::byte> left_;
  bool failed_ = false;
};

namespace fields_detail {

template <class T, template <class...> class Of>
struct Is : std::false_type {};
template <template <class...> class Of, class... T>
struct Is<Of<T...>, Of> : std::true_type {};

template <class T>
concept DynamicEigen = requires(T& m) {
  m.resize(Eigen::Index(), Eigen::Index());
  typename T::Scalar;
};

template <class T>
constexpr bool kUnknown = false;

}  // namespace fields_detail

/// Puts a value into a ByteWriter, ByteCounter or Hasher.
template <class Sink, class T>
void write(Sink& sink, const T& value) {
  using namespace fields_detail;
  if constexpr (is_flat<T>()) {
    sink.bytes(&value, sizeof value);
  } else if constexpr (Is<T, std::vector>::value) {
    const std::uint64_t n = value.size();
    write(sink, n);
    if constexpr (std::is_same_v<T, std::vector<bool>>)
      for (const bool one : value) write(sink, one);
    else if constexpr (is_flat<typename T::value_type>())
      sink.bytes(value.data(), value.size() * sizeof(typename T::value_type));
    else
      for (const auto& one : value) write(sink, one);
  } else if constexpr (std::is_same_v<T, std::string>) {
    write(sink, static_cast<std::uint64_t>(value.size()));
    sink.bytes(value.data(), value.size());
  } else if constexpr (Array<T>::value) {
    for (const auto& one : value) write(sink, one);
  } else if constexpr (Is<T, std::optional>::value || Is<T, std::unique_ptr>::value) {
    write(sink, static_cast<bool>(value));
    if (value) write(sink, *value);
  } else if constexpr (Is<T, std::pair>::value) {
    write(sink, value.first);
    write(sink, value.second);
  } else if constexpr (Is<T, std::map>::value) {
    write(sink, static_cast<std::uint64_t>(value.size()));
    for (const auto& [key, one] : value) {
      write(sink, key);
      write(sink, one);
    }
  } else if constexpr (DynamicEigen<T>) {
    write(sink, static_cast<std::int64_t>(value.rows()));
    write(sink, static_cast<std::int64_t>(value.cols()));
    sink.bytes(value.data(), static_cast<std::size_t>(value.size()) * sizeof(typename T::Scalar));
  } else if constexpr (StateOwner<T>) {
    write(sink, value.state());
  } else if constexpr (HasFields<T>) {
    each_field(value, [&](std::string_view, const auto& member) { write(sink, member); });
  } else {
    static_assert(kUnknown<T>, "declare its fields");
  }
}

/// Takes a value out of a reader; where that fails the value is some valid one, not to be used.
template <class T>
void read(ByteReader& source, T& value) {
  using namespace fields_detail;
  if constexpr (std::is_same_v<T, bool>) {
    std::uint8_t byte = 0;
    source.bytes(&byte, 1);
    if (byte > 1) source.fail();
    value = byte == 1;
  } else if constexpr (is_flat<T>()) {
    source.bytes(&value, sizeof value);
  } else if constexpr (Is<T, std::vector>::value) {
    using One = typename T::value_type;
    if constexpr (std::is_same_v<One, bool>) {
      value.resize(source.count(1));
      for (std::size_t i = 0; i < value.size(); ++i) {
        bool one = false;
        read(source, one);
        value[i] = one;
      }
    } else if constexpr (is_flat<One>()) {
      value.resize(source.count(sizeof(One)));
      source.bytes(value.data(), value.size() * sizeof(One));
    } else {
      const std::size_t n = source.count(1);
      value.resize(std::min(n, value.size()));
      for (std::size_t i = 0; i < n && !source.failed(); ++i) {
        if (i == value.size()) value.emplace_back();
        read(source, value[i]);
      }
    }
  } else if constexpr (std::is_same_v<T, std::string>) {
    value.resize(source.count(1));
    source.bytes(value.data(), value.size());
  } else if constexpr (Array<T>::value) {
    for (auto& one : value) read(source, one);
  } else if constexpr (Is<T, std::optional>::value) {
    bool there = false;
    read(source, there);
    if (!there) return value.reset();
    if constexpr (std::is_default_constructible_v<typename T::value_type>)
      if (!value) value.emplace();
    if (!value) return void(source.fail());
    read(source, *value);
  } else if constexpr (Is<T, std::unique_ptr>::value) {
    bool there = false;
    read(source, there);
    if (!there) return value.reset();
    // What can't be made here must be there already, and only takes its state.
    if constexpr (std::is_default_constructible_v<typename T::element_type>)
      if (!value) value = std::make_unique<typename T::element_type>();
    if (!value) return void(source.fail());
    read(source, *value);
  } else if constexpr (Is<T, std::pair>::value) {
    read(source, value.first);
    read(source, value.second);
  } else if constexpr (Is<T, std::map>::value) {
    value.clear();
    const std::size_t n = source.count(1);
    for (std::size_t i = 0; i < n && !source.failed(); ++i) {
      typename T::key_type key{};
      read(source, key);
      read(source, value[key]);
    }
  } else if constexpr (DynamicEigen<T>) {
    std::int64_t rows = 0, cols = 0;
    read(source, rows);
    read(source, cols);
    constexpr std::int64_t kMost = std::int64_t{1} << 31;
    if (rows < 0 || cols < 0 || rows > kMost || cols > kMost ||
        (T::RowsAtCompileTime != Eigen::Dynamic && rows != T::RowsAtCompileTime) ||
        (T::ColsAtCompileTime != Eigen::Dynamic && cols != T::ColsAtCompileTime) ||
        (T::MaxRowsAtCompileTime != Eigen::Dynamic && rows > T::MaxRowsAtCompileTime) ||
        (T::MaxColsAtCompileTime != Eigen::Dynamic && cols > T::MaxColsAtCompileTime) ||
        !source.holds(static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(cols),
                      sizeof(typename T::Scalar))) {
      source.fail();
      return;
    }
    value.resize(rows, cols);
    source.bytes(value.data(), static_cast<std::size_t>(value.size()) * sizeof(typename T::Scalar));
  } else if constexpr (StateOwner<T>) {
    typename T::State state;
    read(source, state);
    if constexpr (requires { value.fits(state); })
      if (!source.failed() && !value.fits(state)) source.fail();
    if (!source.failed()) value.restore(std::move(state));
  } else if constexpr (HasFields<T>) {
    each_field(value, [&](std::string_view, auto& member) { read(source, member); });
  } else {
    static_assert(kUnknown<T>, "declare its fields");
  }
}

template <class T>
std::vector<std::byte> saved(const T& value) {
  ByteCounter counter;
  write(counter, value);
  ByteWriter writer;
  writer.reserve(counter.count());
  write(writer, value);
  return writer.take();
}

/// Bytes that the value takes when it is saved.
template <class T>
std::size_t saved_bytes(const T& value) {
  ByteCounter counter;
  write(counter, value);
  return counter.count();
}

/// The name of the first field in which two values differ, as "spots[3].rest"; empty: they are the
/// same bit for bit. "." where the difference has no name.
template <class T>
std::string first_difference(const T& a, const T& b) {
  using namespace fields_detail;
  if constexpr (HasFields<T> && !StateOwner<T>) {
    std::string found;
    std::apply(
        [&](const auto&... one) {
          const auto look = [&](const auto& field) {
            if (!found.empty()) return;
            const std::string inside = first_difference(a.*field.member, b.*field.member);
            if (inside.empty()) return;
            found = field.name;
            if (inside != ".") found += (inside[0] == '[' ? "" : ".") + inside;
          };
          (look(one), ...);
        },
        fields_of<T>());
    return found;
  } else if constexpr (StateOwner<T>) {
    return first_difference(a.state(), b.state());
  } else if constexpr (Is<T, std::vector>::value || Array<T>::value) {
    if (a.size() != b.size()) return "[size]";
    for (std::size_t i = 0; i < a.size(); ++i) {
      const std::string inside = first_difference(a[i], b[i]);
      if (inside.empty()) continue;
      return "[" + std::to_string(i) + "]" +
             (inside == "." ? "" : (inside[0] == '[' ? "" : ".") + inside);
    }
    return "";
  } else {
    return saved(a) == saved(b) ? "" : ".";
  }
}

/// A text that tells one layout from another: names and kinds of all fields, in order.
template <class T>
std::string layout_of() {
  using namespace fields_detail;
  if constexpr (Is<T, std::vector>::value || Is<T, std::optional>::value ||
                Is<T, std::unique_ptr>::value) {
    if constexpr (Is<T, std::unique_ptr>::value)
      return "?" + layout_of<typename T::element_type>();
    else
      return (Is<T, std::vector>::value ? "*" : "?") + layout_of<typename T::value_type>();
  } else if constexpr (Array<T>::value) {
    return std::to_string(std::tuple_size_v<T>) + "x" + layout_of<typename T::value_type>();
  } else if constexpr (StateOwner<T>) {
    return layout_of<typename T::State>();
  } else if constexpr (HasFields<T>) {
    std::string text = "{";
    std::apply(
        [&]<class... F>(const F&... one) {
          ((text += std::string(one.name) + ":" + layout_of<typename Member<F>::Type>() + ","),
           ...);
        },
        fields_of<T>());
    return text + "}";
  } else if constexpr (std::is_floating_point_v<T>) {
    return "f" + std::to_string(sizeof(T));
  } else {
    return "b" + std::to_string(sizeof(T));
  }
}

}  // namespace viscera
