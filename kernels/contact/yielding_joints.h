// What gives way between two bodies, the more the farther these have come apart.
#pragma once

#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// Held joints of an island (contact_island.h) that give way together: under forces f their ends
/// come apart by softness f, the same in all directions.
class YieldingJoints {
 public:
  virtual ~YieldingJoints() = default;

  /// Symmetric, positive [m/N]                                                (joints x joints)
  virtual const MatrixX& softness() const = 0;
  /// The ends have come so far apart, by the softness that it has said [m]     (joints). True: it
  /// has another one there.
  virtual bool follow(std::span<const Vec3> apart) = 0;
};

}  // namespace viscera
