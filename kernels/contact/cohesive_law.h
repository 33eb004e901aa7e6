// How a bond between two surfaces yields, and parts.
#pragma once

#include <algorithm>

namespace viscera {

/// Traction over opening: it rises by `stiffness` to `strength`, falls from there along a straight
/// line, and is 0 where the area under both is `toughness`. What has been opened farther once is
/// softer for good, and closes to where it was ("bilinear cohesive law" [Alfano2001]).
struct CohesiveLaw {
  double strength = 0.0;   ///< greatest traction [Pa]
  double stiffness = 0.0;  ///< while it is whole [Pa/m]
  double toughness = 0.0;  ///< work that parts it [J/m2]

  double first() const { return strength / stiffness; }       ///< opening at the strength [m]
  double last() const { return 2.0 * toughness / strength; }  ///< opening that parts it [m]
  /// A law that falls at all: else it would part before it had its strength.
  bool is_sound() const { return strength > 0.0 && stiffness > 0.0 && first() < last(); }

  /// Share of its stiffness that is left once it has been open by `greatest` [m].
  double left(double greatest) const {
    if (greatest <= first()) return 1.0;
    return std::max(0.0, first() * (last() - greatest) / (greatest * (last() - first())));
  }
  /// What has gone into parting it by then and doesn't come back [J/m2].
  double spent(double greatest) const {
    const double open = std::clamp(greatest, first(), last());
    return toughness * (open - first()) / (last() - first());
  }
};

}  // namespace viscera
