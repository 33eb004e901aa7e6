// What will go wrong with a surface as an organ, before it does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/organ/organ_plan.h"
#include "engine/organ/surface_quality.h"

namespace viscera {

/// Node spacings that give a body of this volume about a thousand nodes, and finer ones where it is
/// touched; bounded by what contact and time allow.
Resolution suggested_resolution(double volume);

/// Holds the back quarter of the body: a default to start from.
Region back_region(const Box& box);

struct OrganCheckup {
  SurfaceQuality quality;
  OrganPlan plan;  ///< instruments touching within 20 mm of the frontmost place
  std::vector<std::string> warnings;
};

/// Measures the surface and plans its preparation, tissue values left aside. The description's
/// resolution is made finer where thin parts ask for that; where no resolution will do, the organ
/// becomes scenery, and a warning says so. `label_volume`: what the surface should enclose [m3],
/// where that is known.
OrganCheckup check_organ(const TriangleSurface& surface, OrganDescription& organ,
                         std::optional<double> label_volume);

}  // namespace viscera
