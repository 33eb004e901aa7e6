// Between the faces or the middles of the gas grid's cells at one place: trilinear in the eight
// about it. gas_stencils.h has the same for many places.
#pragma once

#include <algorithm>

#include "kernels/smoke/gas_layout.h"

namespace viscera {

/// The eight faces about a place and their weights.
struct FaceStencil {
  std::ptrdiff_t base;  ///< the least of them
  float x, y, z;        ///< how far towards the others, 0 to 1
};

/// The stencil of the faces across `Axis`, or with 3 of the cells' middles, at a place in cells
/// from the domain's least corner. Beyond the outermost values go on unchanged.
template <int Axis>
inline FaceStencil face_stencil(const GasLayout& layout, float x, float y, float z) {
  const auto part = [&](int axis, float at, int& cell) {
    const int last = layout.n[axis] - (Axis == axis ? 0 : 1);
    // The order of the arguments takes what isn't a number to 0.
    const float inside =
        std::min(std::max(0.0f, at - (Axis == axis ? 0.0f : 0.5f)), static_cast<float>(last));
    cell = std::min(static_cast<int>(inside), std::max(last - 1, 0));
    return inside - static_cast<float>(cell);
  };
  int i, j, k;
  FaceStencil stencil;
  stencil.x = part(0, x, i);
  stencil.y = part(1, y, j);
  stencil.z = part(2, z, k);
  stencil.base = layout.index(i, j, k);
  return stencil;
}

inline float interpolate(const GasLayout& layout, const float* values, const FaceStencil& s) {
  const float* v = values + s.base;
  const std::ptrdiff_t row = layout.stride[1], layer = layout.stride[2];
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float low = mix(mix(v[0], v[1], s.x), mix(v[row], v[row + 1], s.x), s.y);
  const float high =
      mix(mix(v[layer], v[layer + 1], s.x), mix(v[layer + row], v[layer + row + 1], s.x), s.y);
  return mix(low, high, s.z);
}

/// Of the cells' middles.
inline FaceStencil cell_stencil(const GasLayout& layout, const Vec3f& at) {
  return face_stencil<3>(layout, at.x(), at.y(), at.z());
}

/// All three components at a place in cells.
inline Vec3f sample(const GasLayout& layout, const GasFaces& faces, float x, float y, float z) {
  return {interpolate(layout, faces[0].data(), face_stencil<0>(layout, x, y, z)),
          interpolate(layout, faces[1].data(), face_stencil<1>(layout, x, y, z)),
          interpolate(layout, faces[2].data(), face_stencil<2>(layout, x, y, z))};
}

}  // namespace viscera
