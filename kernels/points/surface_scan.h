// The nearest place of a moving surface without a hierarchy: for single questions, where fitting
// one would cost more than looking through the surface once.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

class SurfaceScan {
 public:
  explicit SurfaceScan(const TriangleSurface& rest);

  struct Found {
    int triangle = -1;
    Vec3 weights = Vec3::Zero();
    double distance = 0.0;  ///< [m]
  };
  /// Of the surface of these triangles, those of `rest`, with its vertices at `positions` [m]:
  /// within `radius` [m]; ties go to the lower triangle.                                      (V)
  std::optional<Found> closest(std::span<const std::array<int, 3>> triangles,
                               std::span<const Vec3f> positions, const Vec3& query,
                               double radius) const;

 private:
  static constexpr std::size_t kTriangles = 32;  ///< that lie together, looked through as one

  std::vector<std::size_t> triangles_;  ///< group by group
  std::vector<int> vertices_;           ///< of the groups, each once
  std::vector<std::uint32_t> begins_;   ///< of each group among these, and their end
};

}  // namespace viscera
