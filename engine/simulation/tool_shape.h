// The working end of an instrument as contact sees it: which point of it lies lowest over a place
// of the tissue.
#pragma once

#include <optional>
#include <vector>

#include "engine/simulation/components.h"

namespace viscera {

/// A tip in some frame (world, or an organ's). Refers to the instrument's body for meshes.
struct ToolShape {
  TipDescription::Shape kind = TipDescription::Shape::kSphere;
  Vec3 tip = Vec3::Zero();     ///< [m]
  Vec3 shaft = Vec3::UnitZ();  ///< unit, from the tip towards the trocar
  Vec3 side = Vec3::UnitX();   ///< unit, across the shaft
  double radius = 0.0;         ///< of sphere and capsule; size of a mesh's working end [m]
  double length = 0.0;         ///< of a capsule's axis [m]
  const InstrumentBody* body = nullptr;

  struct Lowest {
    double along = 0.0;             ///< from where it was sought [m]
    Vec3 outward = -Vec3::UnitZ();  ///< unit normal of the tool there
  };
  /// The lowest point `at + along * up` of the tool on the line through `at` along the unit vector
  /// `up`; nothing where the line misses the tool.
  std::optional<Lowest> lowest(const Vec3& at, const Vec3& up) const;
  /// Places of the tool from which the search for tissue starts, each with the radius of the tool
  /// around it [m]: the centre of a sphere, points along a capsule's axis, vertices of a mesh.
  std::vector<Vec3> probes() const;
  double probe_radius() const { return kind == TipDescription::Shape::kMesh ? 0.0 : radius; }
};

/// A tip that has no size (shape "point") touches through a ball of this radius [m].
inline constexpr double kPointTipRadius = 0.5e-3;

/// Openings below which a grasper's jaw closes, and above which it lets go: one in between keeps
/// what it holds.
inline constexpr double kJawCloses = 0.15, kJawLetsGo = 0.3;
constexpr bool jaw_closed(bool was_closed, double jaw) {
  return jaw < (was_closed ? kJawLetsGo : kJawCloses);
}

/// The instrument's tip now, in the frame that `pose` places in the world.
ToolShape tool_shape(const InstrumentBody& body, const InstrumentState& state, const Pose& pose);

}  // namespace viscera
