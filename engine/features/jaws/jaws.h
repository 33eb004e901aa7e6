// Both jaws of a grasper as bodies: they press with the force of the handle, rub what they hold,
// turn it with them, and lose what slides out (docs/theory/jaws.md).
#pragma once

#include "engine/features/jaws/jaws_flags.h"
#include "engine/features/jaws/jaws_keys.h"
#include "engine/simulation/feature.h"

namespace viscera {

/// On an instrument whose jaws hold by their force.
struct JawsBody {
  static constexpr bool kConstant = true;
  double force = 0.0;  ///< of each, fully closed [N]
  double friction = 0.0;
  KeyFrames turn;  ///< in x [rad]
  bool turns = false;
};

/// What such jaws do. World's axes.
struct Jaws {
  static constexpr std::string_view kName = "jaws";
  // This frame's.
  Vec3 tip = Vec3::Zero();      ///< [m]
  Vec3 shaft = Vec3::UnitZ();   ///< unit
  Vec3 normal = Vec3::UnitX();  ///< unit, across the plane between the jaws
  double turn = 0.0;            ///< of the handle [rad]
  double force = 0.0;           ///< of each jaw [N]
  // When what they hold was taken.
  Vec3 shaft_then = Vec3::UnitZ();
  Vec3 normal_then = Vec3::UnitX();
  std::uint64_t upper = 0;  ///< cells on the jaw at the side of `normal`; 0: one patch, a fold
  double gap_then = 0.0;    ///< between the jaws [m]
  double thickness = 0.0;   ///< of the same tissue at rest [m]
  // Since then.
  Vec3 slid = Vec3::Zero();  ///< of the jaws over the tissue, in the axes of then [m]
  double closed = 0.0;       ///< how much nearer the jaws came [m]
  // Within this frame.
  Vec3 slid_before = Vec3::Zero();  ///< as `slid` at its start [m]
  double closed_before = 0.0;       ///< [m]
  bool taken = false;               ///< other tissue than in the last, while they slid
  Vec3 dragged = Vec3::Zero();      ///< the way friction pulled the tissue in the last; unit, or 0
  bool sliding = false;
  bool shut = false;  ///< as near as they come
  std::uint64_t trials = 0;
  Vec3 friction = Vec3::Zero();  ///< on the tissue, as of the last trial [N]
  Vec3 awaited = Vec3::Zero();   ///< what that trial's slide was to change of it [N]
  double squeeze = 0.0;          ///< of either jaw; of a fold 0 [N]
  double awaited_squeeze = 0.0;  ///< [N]
  // Of tissue's stiffness as it answered in trials, over what its response said.
  double stiffer_along = 1.0, stiffer_across = 1.0;
  // Told.
  Vec3 torque = Vec3::Zero();  ///< on the instrument about its tip [N m]
  std::array<Vec3, 2> presses = {Vec3::Zero(), Vec3::Zero()};  ///< on the tissue, each jaw's [N]
  double way = 0.0;                                            ///< that it slid in all [m]
  std::uint64_t retaken = 0, lost = 0, shut_frames = 0;

  static constexpr auto fields() {
    using J = Jaws;
    return std::tuple(
        field("tip", &J::tip), field("shaft", &J::shaft), field("normal", &J::normal),
        field("turn", &J::turn), field("force", &J::force), field("shaft_then", &J::shaft_then),
        field("normal_then", &J::normal_then), field("upper", &J::upper),
        field("gap_then", &J::gap_then), field("thickness", &J::thickness), field("slid", &J::slid),
        field("closed", &J::closed), field("slid_before", &J::slid_before),
        field("closed_before", &J::closed_before), field("taken", &J::taken),
        field("dragged", &J::dragged), field("sliding", &J::sliding), field("shut", &J::shut),
        field("trials", &J::trials), field("friction", &J::friction), field("awaited", &J::awaited),
        field("squeeze", &J::squeeze), field("awaited_squeeze", &J::awaited_squeeze),
        field("stiffer_along", &J::stiffer_along), field("stiffer_across", &J::stiffer_across),
        field("torque", &J::torque), field("presses", &J::presses), field("way", &J::way),
        field("retaken", &J::retaken), field("lost", &J::lost),
        field("shut_frames", &J::shut_frames));
  }
};
static_assert(fields_cover<Jaws>());

/// The share of the handle's force at this opening: all when closed, none from the opening on at
/// which a jaw lets go.
double share_of_grip(double jaw);

Feature jaws_feature();

}  // namespace viscera
