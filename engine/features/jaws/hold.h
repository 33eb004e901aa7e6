// What lies between two jaws, and where they carry it.
#pragma once

#include <optional>
#include <span>

#include "engine/features/jaws/jaws.h"

namespace viscera {

/// A hand closes jaws on tissue no faster than this [m/s]. Chosen.
inline constexpr double kClosingSpeed = 30e-3;
/// Elastic tissue, that nothing but its modulus stiffens, doesn't bear what squeezes it: that stops
/// at this share of its thickness. Chosen.
inline constexpr double kLeastGap = 1.0 / 3.0;

/// To be called once a frame, before anything is taken: where the jaws are, carried with the shaft
/// without spin but the handle's.
void move_jaws(const JawsBody& body, const InstrumentState& state, double time, bool hold,
               Jaws& jaws);
/// Whether they slid so far over what they hold that they should hold what lies between them now.
bool should_retake(const Jaws& jaws, double radius);

/// Tissue between two sides.
struct Pinch {
  Entity organ;
  std::vector<ContactCell> cells;     ///< of the upper jaw, then as many of the lower
  std::vector<SurfacePoint> points;   ///< of the drawn surface
  double gap = 0.0, thickness = 0.0;  ///< mean, as drawn and at rest [m]
};
/// False: an organ of which nothing is to be found so near.
bool may_lie_within(const World& world, Entity organ, const Vec3& middle, double distance);
/// What of such an organ two sides pinch, each half of `opening` away from `places` (between them,
/// organ's frame) along the unit `normal` (world): a pair of cells, of these areas, at each place
/// whose line meets it from both sides. May have none.
Pinch pinched(const World& world, Entity organ, std::span<const Vec3> places,
              std::span<const double> areas, const Vec3& normal, double opening);
/// Tissue that two jaws with this middle pinch from two sides: of all organs (or one) the one of
/// which most lies between. Nothing: there aren't two sides within their opening.
std::optional<Pinch> between_jaws(const World& world, const Vec3& middle, const Vec3& normal,
                                  double radius, std::optional<Entity> only);
/// The same of open jaws, but only whether there is such tissue on this organ.
bool lies_between(const World& world, Entity organ, const Vec3& middle, const Vec3& normal,
                  double radius);

/// What was just taken is held from here on. `again`: by jaws that slid, which go on from where
/// they were a frame ago, and rub as they did.
struct JawPose {
  Vec3 tip, shaft, normal;
};
JawPose pose_of_jaws(const Jaws& jaws);
void begin_hold(const JawPose& pose, const Pinch* pinch, bool again, Jaws& jaws, Grasp& grasp);

/// u wanted of a held cell, `k` of the grasp's [m], organ's frame.
Vec3 carried(const Jaws& jaws, const Grasp& grasp, std::size_t k, const Pose& organ);

}  // namespace viscera
