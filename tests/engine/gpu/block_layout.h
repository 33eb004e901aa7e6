// Structs as C++ lays them out against the blocks of a program as the driver does.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "engine/gpu/program.h"
#include "kernels/base/device_vectors.h"

namespace viscera {

/// GLSL's type of a C++ one; of an array, its elements'.
template <class T>
constexpr unsigned gl_type() {
  if constexpr (std::is_array_v<T>) {
    return gl_type<std::remove_all_extents_t<T>>();
  } else if constexpr (std::is_enum_v<T>) {
    return gl_type<std::underlying_type_t<T>>();
  } else if constexpr (requires { typename std::tuple_element<0, T>::type; }) {
    return gl_type<std::tuple_element_t<0, T>>();
  } else if constexpr (std::is_same_v<T, float>) {
    return GL_FLOAT;
  } else if constexpr (std::is_same_v<T, double>) {
    return GL_DOUBLE;
  } else if constexpr (std::is_same_v<T, std::int32_t>) {
    return GL_INT;
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    return GL_UNSIGNED_INT;
  } else if constexpr (std::is_same_v<T, Float4> || std::is_same_v<T, Eigen::Vector4f>) {
    return GL_FLOAT_VEC4;
  } else if constexpr (std::is_same_v<T, Int4>) {
    return GL_INT_VEC4;
  } else {
    static_assert(std::is_same_v<T, Eigen::Matrix4f>, "no twin in GLSL");
    return GL_FLOAT_MAT4;
  }
}

struct MemberLayout {
  std::string name;  ///< "origin"; within a struct's struct "numbers.boiling"
  unsigned type = 0;
  std::size_t offset = 0, size = 0;  ///< all of an array
};

struct StructLayout {
  std::size_t size = 0;
  std::vector<MemberLayout> members;
};

template <class T>
MemberLayout member_layout(const char* name, std::size_t offset, const T&) {
  return {name, gl_type<T>(), offset, sizeof(T)};
}
/// One member of `Struct`, for StructLayout's list.
#define VISCERA_MEMBER(Struct, member) \
  ::viscera::member_layout(#member, offsetof(Struct, member), Struct{}.member)

/// What is wrong with a program's blocks, in alphabetical order, one line a mistake: "Pass.origin:
/// vec4 at byte 16, 16 long; in C++ vec4 at byte 0, 16 long". `expected`: what C++ puts into each
/// block of structs, by the block's name: one of them, or an array without an end. A block of
/// structs that isn't among them is a mistake, and so are members that one side alone has. An array
/// of anything else must have no holes. Names of the expected blocks that are there go to `seen`,
/// where it is given.
std::vector<std::string> compare_blocks(const Program& program,
                                        const std::map<std::string, StructLayout>& expected,
                                        std::vector<std::string>* seen = nullptr);

}  // namespace viscera
