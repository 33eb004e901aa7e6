// Looks for numbers that aren't finite in whatever declares its fields (fields.h), and sets them to
// zero.
#pragma once

#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "kernels/base/archive.h"

namespace viscera {

struct StrayNumber {
  std::string field;  ///< "velocity.x[12]"; as first_difference() names it
  double value = 0.0;
};

/// Of numbers that aren't finite all bits of the exponent are set. No branch, so that several are
/// looked at together.
inline bool all_finite(std::span<const float> values) {
  constexpr std::uint32_t kExponent = 0x7f80'0000u;
  std::uint32_t strays = 0;
  for (const float value : values)
    strays |= (std::bit_cast<std::uint32_t>(value) & kExponent) == kExponent ? 1u : 0u;
  return strays == 0;
}

inline bool all_finite(std::span<const double> values) {
  constexpr std::uint64_t kExponent = 0x7ff0'0000'0000'0000u;
  std::uint64_t strays = 0;
  for (const double value : values)
    strays |= (std::bit_cast<std::uint64_t>(value) & kExponent) == kExponent ? 1u : 0u;
  return strays == 0;
}

namespace finite_detail {

using namespace fields_detail;

/// What a flat type's numbers are: all float, all double, none that could be anything but finite,
/// or several kinds.
enum class Numbers { kNone, kFloat, kDouble, kMixed };

constexpr Numbers both(Numbers a, Numbers b) {
  return a == b ? a : Numbers::kMixed;
}

template <class T>
consteval Numbers numbers_in() {
  if constexpr (std::is_same_v<T, float>) {
    return Numbers::kFloat;
  } else if constexpr (std::is_same_v<T, double>) {
    return Numbers::kDouble;
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
    return Numbers::kNone;
  } else if constexpr (FixedEigen<T>::value) {
    return numbers_in<typename T::Scalar>();
  } else if constexpr (Array<T>::value) {
    return numbers_in<typename T::value_type>();
  } else {
    return std::apply(
        []<class First, class... F>(const First&, const F&...) {
          Numbers all = numbers_in<typename Member<First>::Type>();
          ((all = both(all, numbers_in<typename Member<F>::Type>())), ...);
          return all;
        },
        fields_of<T>());
  }
}

/// The numbers of a flat type whose kind is one.
template <class Number, class T>
auto numbers_of(T* first, std::size_t count) {
  using To = std::conditional_t<std::is_const_v<T>, const Number, Number>;
  return std::span<To>(reinterpret_cast<To*>(first), count * sizeof(T) / sizeof(Number));
}

inline std::string numbered(std::size_t i, const std::string& inside) {
  return "[" + std::to_string(i) + "]" +
         (inside.empty() || inside[0] == '[' ? inside : "." + inside);
}

}  // namespace finite_detail

/// Whether all numbers of a value are finite: what is looked at in every frame, of states that may
/// be large. first_stray() says where one isn't.
template <class T>
bool free_of_strays(const T& value) {
  using namespace finite_detail;
  const auto all = [](const auto* first, std::size_t count) {
    using One = std::remove_cvref_t<decltype(*first)>;
    if constexpr (is_flat<One>()) {
      constexpr Numbers kind = numbers_in<One>();
      if constexpr (kind == Numbers::kNone) return true;
      if constexpr (kind == Numbers::kFloat) return all_finite(numbers_of<float>(first, count));
      if constexpr (kind == Numbers::kDouble) return all_finite(numbers_of<double>(first, count));
    }
    bool finite = true;
    for (std::size_t i = 0; i < count; ++i) finite &= free_of_strays(first[i]);
    return finite;
  };
  if constexpr (std::is_floating_point_v<T>) {
    return all_finite(std::span<const T>(&value, 1));
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T> ||
                       std::is_same_v<T, std::string> || std::is_same_v<T, std::vector<bool>>) {
    return true;
  } else if constexpr (FixedEigen<T>::value) {
    using Scalar = typename T::Scalar;
    return all(reinterpret_cast<const Scalar*>(&value), sizeof value / sizeof(Scalar));
  } else if constexpr (DynamicEigen<T> || Is<T, std::vector>::value || Array<T>::value) {
    return all(value.data(), static_cast<std::size_t>(value.size()));
  } else if constexpr (Is<T, std::optional>::value || Is<T, std::unique_ptr>::value) {
    return !value || free_of_strays(*value);
  } else if constexpr (Is<T, std::pair>::value) {
    return free_of_strays(value.first) & free_of_strays(value.second);
  } else if constexpr (Is<T, std::map>::value) {
    bool finite = true;
    for (const auto& one : value) finite &= free_of_strays(one);
    return finite;
  } else if constexpr (StateOwner<T>) {
    return free_of_strays(value.state());
  } else {
    bool finite = true;
    each_field(value,
               [&](std::string_view, const auto& member) { finite &= free_of_strays(member); });
    return finite;
  }
}

/// The first number that isn't finite; none: all are.
template <class T>
std::optional<StrayNumber> first_stray(const T& value) {
  using namespace finite_detail;
  if (free_of_strays(value)) return std::nullopt;
  const auto among = [](const auto* first, std::size_t count) -> std::optional<StrayNumber> {
    for (std::size_t i = 0; i < count; ++i)
      if (auto stray = first_stray(first[i])) {
        stray->field = numbered(i, stray->field);
        return stray;
      }
    return std::nullopt;
  };
  if constexpr (std::is_floating_point_v<T>) {
    return StrayNumber{"", static_cast<double>(value)};
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T> ||
                       std::is_same_v<T, std::string> || std::is_same_v<T, std::vector<bool>>) {
    return std::nullopt;
  } else if constexpr (FixedEigen<T>::value) {
    using Scalar = typename T::Scalar;
    return among(reinterpret_cast<const Scalar*>(&value), sizeof value / sizeof(Scalar));
  } else if constexpr (DynamicEigen<T> || Is<T, std::vector>::value || Array<T>::value) {
    return among(value.data(), static_cast<std::size_t>(value.size()));
  } else if constexpr (Is<T, std::optional>::value || Is<T, std::unique_ptr>::value) {
    return first_stray(*value);
  } else if constexpr (Is<T, std::pair>::value) {
    auto stray = first_stray(value.first);
    return stray ? stray : first_stray(value.second);
  } else if constexpr (Is<T, std::map>::value) {
    std::size_t i = 0;
    for (const auto& one : value) {
      if (auto stray = first_stray(one)) {
        stray->field = numbered(i, stray->field);
        return stray;
      }
      ++i;
    }
    return std::nullopt;
  } else if constexpr (StateOwner<T>) {
    return first_stray(value.state());
  } else {
    std::optional<StrayNumber> found;
    each_field(value, [&](std::string_view name, const auto& member) {
      if (found) return;
      found = first_stray(member);
      if (!found) return;
      const std::string inside = std::move(found->field);
      found->field = name;
      if (!inside.empty()) found->field += (inside[0] == '[' ? "" : ".") + inside;
    });
    return found;
  }
}

/// Zero for every number that isn't finite. A StateOwner takes the state that comes of it.
template <class T>
void zero_strays(T& value) {
  using namespace finite_detail;
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) value = T(0);
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T> ||
                       std::is_same_v<T, std::string> || std::is_same_v<T, std::vector<bool>>) {
    return;
  } else if constexpr (FixedEigen<T>::value) {
    using Scalar = typename T::Scalar;
    auto* first = reinterpret_cast<Scalar*>(&value);
    for (std::size_t i = 0; i < sizeof value / sizeof(Scalar); ++i) zero_strays(first[i]);
  } else if constexpr (DynamicEigen<T>) {
    for (Eigen::Index i = 0; i < value.size(); ++i) zero_strays(value.data()[i]);
  } else if constexpr (Is<T, std::vector>::value || Array<T>::value) {
    for (auto& one : value) zero_strays(one);
  } else if constexpr (Is<T, std::optional>::value || Is<T, std::unique_ptr>::value) {
    if (value) zero_strays(*value);
  } else if constexpr (Is<T, std::pair>::value) {
    zero_strays(value.first);
    zero_strays(value.second);
  } else if constexpr (Is<T, std::map>::value) {
    for (auto& [key, one] : value) zero_strays(one);
  } else if constexpr (StateOwner<T>) {
    typename T::State state = value.state();
    zero_strays(state);
    value.restore(std::move(state));
  } else {
    each_field(value, [](std::string_view, auto& member) { zero_strays(member); });
  }
}

}  // namespace viscera
