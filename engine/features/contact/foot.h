// Where a tool meets an organ, and which way is out of the tissue there.
#pragma once

#include <optional>

#include "engine/features/contact/tissue_sheet.h"
#include "engine/simulation/tool_shape.h"

namespace viscera {

/// The tissue nearest to a tool.
struct Foot {
  Vec3 probe = Vec3::Zero();     ///< place of the tool that is nearest [m]
  Vec3 position = Vec3::Zero();  ///< of the tissue [m]
  Vec3 outward = Vec3::UnitZ();  ///< unit; mean normal of the tissue around
  double clearance = 0.0;        ///< between tool and tissue; negative when it penetrates [m]
};

/// The tissue may move this far towards or away from a tool within a frame and still be found [m].
inline constexpr double kFrameReach = 6e-3;

/// On the surface as it is drawn: where the tool presses, that is its own dent. Nothing when no
/// tissue lies within `margin` of the tool [m].
std::optional<Foot> find_foot(const ToolShape& tool, double margin, const OrganModel& model,
                              const OrganState& state, const CollisionSurface& surface);

/// On the surface as it would be without the tool, `met`; `drawn` tells which side of a thin body
/// is meant. Clearance is measured along the mean normal: its negative is how deep the tool is in.
std::optional<Foot> find_foot_as_met(const ToolShape& tool, double margin, const OrganModel& model,
                                     const TissueSheet& drawn, const TissueSheet& met);

/// Two unit vectors that span the plane across `up`.
std::pair<Vec3, Vec3> plane_across(const Vec3& up);

/// The tissue of `foot` on the line through `at` along foot.outward, within `span` of its height
/// [m].
std::optional<TissueSheet::Hit> tissue_under(const Vec3& at, const Foot& foot, double span,
                                             const TissueSheet& sheet);

}  // namespace viscera
