// GLSL made from a C++ header: what both languages know is declared once, in C++.
#pragma once

#include "engine/gpu/program.h"
#include "kernels/base/result.h"

namespace viscera {

/// The GLSL of a twin header, a C++ header of parameter structs, enums and constants alone. It
/// keeps the header's lines, so that a compiler's complaint names the line that people see.
///   structs: members of float, double, 32-bit integers, Float4, Int4, Eigen::Vector4f,
///     Eigen::Matrix4f, the header's enums and twin structs, and arrays of them, `T name[N]` or
///     `std::array<T, N>`; initial values, defaulted comparisons and static functions are
///     left out;
///   enums: a constant uint an enumerator, without the enum's name before it;
///   constants: `inline constexpr T kName = ...;`, T as above or std::size_t, which becomes uint.
/// Directives, the namespace and static_assert are left out. Whatever else there is, is an error:
/// "smoke_passes.h:12: found 'bool', expected ...".
Result<ShaderFile> glsl_of_header(const ShaderFile& header);

}  // namespace viscera
