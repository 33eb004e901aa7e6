// Ways of a body that nothing holds: what of them moves and turns all of it.
#pragma once

#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// Nodes of a body: where they lie at rest [m], and their masses [kg].
struct FreeNodes {
  std::span<const Vec3> positions;
  std::span<const double> masses;
};

/// What of a way moves all of a body that is displaced by u, about its centre of mass there.
struct RigidWay {
  Vec3 centre = Vec3::Zero(), shift = Vec3::Zero();  ///< [m]
  Vec3 turn = Vec3::Zero();                          ///< [rad]
};
/// By the momentum and the angular momentum of the way.                                     (3 N)
RigidWay rigid_part(const FreeNodes& nodes, const VectorX& u, const VectorX& way);

/// u after a way whose turn is made as one: as a straight way it would stretch the body by half its
/// square. `rigidly`: after that part of the way alone.                                     (3 N)
VectorX gone_by(const FreeNodes& nodes, const VectorX& u, const VectorX& way, bool rigidly = false);

}  // namespace viscera
