// Whether two places of a surface are on the same side of the body.
#pragma once

#include <algorithm>

namespace viscera {

/// Of the cosine between their normals: 1 within 60 degrees, smoothly 0 from 90 on. Places see each
/// other across a flat or gently bent surface; not through a thin body.
inline double facing(double cosine) {
  const double t = std::clamp(2.0 * cosine, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace viscera
