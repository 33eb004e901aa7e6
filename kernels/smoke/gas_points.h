// Places and vectors that others keep, as the gas grid reads and writes them.
#pragma once

#include <cstddef>
#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// n vectors, components in three arrays (stride 1) or interleaved (stride 3).
template <class T>
struct StridedVectors {
  T *x = nullptr, *y = nullptr, *z = nullptr;
  std::ptrdiff_t stride = 1;
  std::size_t size = 0;

  StridedVectors() = default;
  StridedVectors(std::span<T> xs, std::span<T> ys, std::span<T> zs)
      : x(xs.data()), y(ys.data()), z(zs.data()), size(xs.size()) {}
  template <class Vector>
  explicit StridedVectors(std::span<Vector> vectors)
      : x(vectors.empty() ? nullptr : vectors.front().data()),
        y(x ? x + 1 : nullptr),
        z(x ? x + 2 : nullptr),
        stride(3),
        size(vectors.size()) {}

  Vec3f at(std::size_t i) const {
    const auto o = static_cast<std::ptrdiff_t>(i) * stride;
    return {x[o], y[o], z[o]};
  }
  void set(std::size_t i, const Vec3f& v) const {
    const auto o = static_cast<std::ptrdiff_t>(i) * stride;
    x[o] = v.x(), y[o] = v.y(), z[o] = v.z();
  }
};

/// Places [m] relative to `origin` [m, world].
struct GasPoints {
  Vec3 origin = Vec3::Zero();
  StridedVectors<const float> places;

  std::size_t size() const { return places.size; }
};

}  // namespace viscera
