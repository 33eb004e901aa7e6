// Vectors of four as devices lay them out: GLSL's vec4 and ivec4.
#pragma once

#include <cstdint>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

struct alignas(16) Float4 {
  float x = 0.0f, y = 0.0f, z = 0.0f, w = 0.0f;

  Vec3f xyz() const { return {x, y, z}; }
  void set_xyz(const Vec3f& v) { x = v.x(), y = v.y(), z = v.z(); }
  static Float4 from(const Vec3f& v, float w = 0.0f) { return {v.x(), v.y(), v.z(), w}; }
  static constexpr auto fields() {
    return std::tuple(field("x", &Float4::x), field("y", &Float4::y), field("z", &Float4::z),
                      field("w", &Float4::w));
  }
};

struct alignas(16) Int4 {
  std::int32_t x = 0, y = 0, z = 0, w = 0;
};

}  // namespace viscera
