// Whether every number in a value is one, by the fields that it declares (kernels/base/fields.h).
#pragma once

#include <cmath>
#include <type_traits>

#include "kernels/base/fields.h"

namespace viscera::test {

/// Of numbers, fixed Eigen types, structs with fields and ranges of these. What counts is always
/// finite.
template <class T>
bool all_finite(const T& value) {
  if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value);
  } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
    return true;
  } else if constexpr (HasFields<T>) {
    bool finite = true;
    each_field(value, [&](auto, const auto& member) { finite = all_finite(member) && finite; });
    return finite;
  } else if constexpr (requires { value.allFinite(); }) {
    return value.allFinite();
  } else if constexpr (requires { value.coeffs().allFinite(); }) {
    return value.coeffs().allFinite();
  } else {
    bool finite = true;
    for (const auto& one : value) finite = all_finite(one) && finite;
    return finite;
  }
}

}  // namespace viscera::test
