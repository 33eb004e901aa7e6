// Tissue that tears: where it is pulled farther than its ultimate strain it parts, across the way
// in which it is stretched most.
#pragma once

#include <optional>

#include "engine/simulation/feature.h"
#include "kernels/finite/pulled_tissue.h"
#include "kernels/parting/tissue_share.h"

namespace viscera {

/// Tissue holds while no stretch is greater than `stretch` or its greatest stress is less than
/// `stress`. What is squeezed between jaws widens by as much as what is pulled, without the stress.
/// Half of what a strip has that is pulled so far. Chosen: nearer to all of it, tissue that is
/// drawn two ways at once or held at its sides would hold too long; nearer to none, what bulges
/// would tear.
struct TearLimit {
  static constexpr double kShareOfStrip = 0.5;

  LawModuli law;
  double stretch = 1.0;  ///< 1 and the ultimate strain
  double stress = 0.0;   ///< over relative modulus [Pa]

  static TearLimit of(const LawModuli& law, double ultimate_strain) {
    const double stretch = 1.0 + ultimate_strain;
    return {law, stretch, kShareOfStrip * strip_stress(law, stretch)};
  }
};

/// The greatest stretch of tissue that tears; nothing: it holds. What is turned inside out isn't
/// asked.
std::optional<PrincipalStretch> torn(const PointDeformation& point, const TearLimit& limit);

/// What parts about a point: a plate with a round rim, at rest in the organ's frame.
struct TornDisc {
  Vec3 middle = Vec3::Zero();   ///< [m]
  Vec3 across = Vec3::UnitX();  ///< unit, its normal
  double radius = 0.0;          ///< of its flat part [m]
  double thickness = 0.0;       ///< [m]

  double distance(const Vec3& place) const;  ///< negative inside [m]
  Box reach() const;
};

/// Radius of a point's disc over the cube root of its volume. Chosen: as wide as discs of the
/// point's share of a plane they would leave gaps; a cell's four points of a plane are the farthest
/// apart, 2 / sqrt(3) of that root, and discs so wide just reach the middle between them.
inline constexpr double kOfTornDisc = 0.8165;

/// Where tissue is pulled too far -> OrganCut.
void tear_tissue(World& world, const FrameContext& context);

/// Whether any organ may tear.
bool may_tear(const World& world);

}  // namespace viscera
