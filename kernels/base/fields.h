// Declares what a struct consists of, once. Copying is the struct's own; equality, hash, save,
// load, memory count and a signature of the layout follow from the declaration (archive.h).
//
//   struct Cling {
//     Vec3 tip = Vec3::Zero();
//     std::vector<Spot> spots;
//     static constexpr auto fields() {
//       return std::tuple(field("tip", &Cling::tip), field("spots", &Cling::spots));
//     }
//   };
//   static_assert(fields_cover<Cling>());
//
// The assertion fails where a member isn't declared, or not in its order; only one that hides in
// the padding behind a smaller one escapes it.
//
// A class that computes keeps what lasts from call to call in such a struct, `State`, and tells it
// by state(), takes it by restore(State), and says by fits(State) whether one is its own. What it
// holds besides is made from that, or of no effect.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

template <class Owner, class T>
struct Field {
  std::string_view name;
  T Owner::*member;
};

template <class Owner, class T>
constexpr Field<Owner, T> field(std::string_view name, T Owner::*member) {
  return {name, member};
}

template <class T>
concept HasFields = requires {
  T::fields();
}
|| std::is_same_v<std::remove_const_t<T>, Pose>;

template <HasFields T>
constexpr auto fields_of() {
  if constexpr (std::is_same_v<std::remove_const_t<T>, Pose>)
    return std::tuple(field("position", &Pose::position), field("orientation", &Pose::orientation));
  else
    return T::fields();
}

/// Keeps its lasting values in a `State` (see above).
template <class T>
concept StateOwner = requires(T& owner, const T& constant, typename T::State state) {
  { constant.state() } -> std::convertible_to<const typename T::State&>;
  owner.restore(std::move(state));
};

/// Calls visit(name, member) for every field of `value`, in order.
template <class T, class Visit>
void each_field(T& value, Visit&& visit) {
  std::apply([&](const auto&... one) { (visit(one.name, value.*one.member), ...); },
             fields_of<T>());
}

namespace fields_detail {

template <class T>
struct FixedEigen : std::false_type {};
template <class S, int R, int C, int O, int MR, int MC>
struct FixedEigen<Eigen::Matrix<S, R, C, O, MR, MC>>
    : std::bool_constant<R != Eigen::Dynamic && C != Eigen::Dynamic> {};
template <class S, int O>
struct FixedEigen<Eigen::Quaternion<S, O>> : std::true_type {};
template <class S, int N>
struct FixedEigen<Eigen::AlignedBox<S, N>> : std::true_type {};

template <class T>
struct Array : std::false_type {};
template <class T, std::size_t N>
struct Array<std::array<T, N>> : std::true_type {};

template <class T>
struct Member;
template <class Owner, class T>
struct Member<Field<Owner, T>> {
  using Type = T;
};

/// Size that the declared fields would have in their order, without and with padding.
template <class T>
consteval std::pair<std::size_t, std::size_t> sizes() {
  std::size_t bare = 0, padded = 0;
  std::apply(
      [&]<class... F>(const F&...) {
        const auto add = [&](std::size_t size, std::size_t alignment) {
          bare += size;
          padded = (padded + alignment - 1) / alignment * alignment + size;
        };
        (add(sizeof(typename Member<F>::Type), alignof(typename Member<F>::Type)), ...);
      },
      fields_of<T>());
  return {bare, (padded + alignof(T) - 1) / alignof(T) * alignof(T)};
}

}  // namespace fields_detail

/// The fields are all that the struct has.
template <HasFields T>
consteval bool fields_cover() {
  return fields_detail::sizes<T>().second == sizeof(T);
}

/// All of its bytes are its value: no pointer, no padding. An array of such is copied whole.
template <class T>
consteval bool is_flat() {
  if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
    return !std::is_same_v<T, long double>;
  } else if constexpr (fields_detail::FixedEigen<T>::value) {
    return true;
  } else if constexpr (fields_detail::Array<T>::value) {
    return is_flat<typename T::value_type>();
  } else if constexpr (HasFields<T>) {
    return fields_detail::sizes<T>().first == sizeof(T) &&
           std::apply(
               []<class... F>(const F&...) {
                 return (is_flat<typename fields_detail::Member<F>::Type>() && ...);
               },
               fields_of<T>());
  } else {
    return false;
  }
}

}  // namespace viscera
