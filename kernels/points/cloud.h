// The node cloud that carries a body's elastic field.
#pragma once

#include <cstddef>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Nodes; the first `surface_count` lie on the body's surface.
struct PointCloud {
  std::vector<Vec3> positions;   ///< [m]                                              (N)
  std::vector<double> spacings;  ///< h_J: mean distance to the six nearest nodes [m]  (N)
  std::size_t surface_count = 0;

  std::size_t size() const { return positions.size(); }
};

}  // namespace viscera
