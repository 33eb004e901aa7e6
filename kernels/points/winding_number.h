// How often a surface winds around a point, also for surfaces with holes.
#pragma once

#include <memory>

#include "kernels/points/surface.h"

namespace viscera {

/// Generalised winding number of a triangle surface [Jacobson2013]: 1 inside and 0 outside of a
/// closed one that is oriented outwards, and in between, smoothly, where holes let the two mix.
/// Far groups of triangles count as one dipole each [Barill2018].
class WindingNumber {
 public:
  explicit WindingNumber(const TriangleSurface& surface);
  ~WindingNumber();
  WindingNumber(WindingNumber&&) noexcept;
  WindingNumber& operator=(WindingNumber&&) noexcept;

  /// Queries from many threads at once are safe. Error below 0.03.
  double operator()(const Vec3& query) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
