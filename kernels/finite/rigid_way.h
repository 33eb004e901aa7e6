// Ways of a piece of tissue that nothing holds: what of them moves and turns all of it.
#pragma once

#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// A piece of a body: which of its nodes, where all of them lie at rest [m], their masses [kg].
struct FreeNodes {
  std::span<const int> nodes;
  std::span<const Vec3> positions;  // (N)
  std::span<const double> masses;   // (N)
};

/// What of a way moves all of a piece that is displaced by u, about its centre of mass there.
struct RigidWay {
  Vec3 centre = Vec3::Zero(), shift = Vec3::Zero();  ///< [m]
  Vec3 turn = Vec3::Zero();                          ///< [rad]
};
/// By the momentum and the angular momentum of the way.                                     (3 N)
RigidWay rigid_part(const FreeNodes& nodes, const VectorX& u, const VectorX& way);

/// Sets `next` of the piece's nodes to u after a way whose turn is made as one: as a straight way
/// it would stretch the piece by half its square. `rigidly`: by that part of the way alone.  (3 N)
void go_by(const FreeNodes& nodes, const VectorX& u, const VectorX& way, bool rigidly,
           VectorX& next);

}  // namespace viscera
