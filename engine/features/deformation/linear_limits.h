// Whether organs are moved beyond what linear tissue carries.
#pragma once

#include <string>
#include <vector>

#include "engine/simulation/world.h"
#include "kernels/contact/surface_strains.h"

namespace viscera {

/// Linear tissue that turns by an angle a grows by 1 / cos a - 1: 2 % at this one [rad].
inline constexpr double kMostRotation = 0.2;
/// Its strain e lacks the e^2 / 2 of Green's: 7.5 % of it at this one.
inline constexpr double kMostStretch = 0.15;

/// Of organs that were prepared: samples of the surface a node's spacing wide.
struct OrganGradients {
  static constexpr bool kConstant = true;
  SurfaceGradients surface;
};

/// Of one organ since the start. Shapes whose displacements are too small for half of the limits
/// aren't measured.
struct GreatestStrains {
  static constexpr std::string_view kName = "greatest strains";
  double rotation = 0.0, rotation_at = 0.0;  ///< [rad], and when [s]
  double stretch = 0.0, stretch_at = 0.0;    ///< share of length, and when [s]
  static constexpr auto fields() {
    using S = GreatestStrains;
    return std::tuple(field("rotation", &S::rotation), field("rotation_at", &S::rotation_at),
                      field("stretch", &S::stretch), field("stretch_at", &S::stretch_at));
  }
};
static_assert(fields_cover<GreatestStrains>());

/// Of the shape that an organ has: measured once for each.
struct StrainsNow {
  std::uint64_t version = 0;  ///< of OrganState
  bool known = false;
  SurfaceStrains strains;
};

void prepare_linear_limits(SceneModel& model);
void start_linear_limits(World& world);
/// OrganState -> GreatestStrains; whether some organ is beyond the limits now.
/// At `time` [s].
bool measure_strains(World& world, double time);
/// To be called when the state is another one: what was measured isn't of it.
void forget_strains(World& world);
/// A sentence for each organ that was beyond.
std::vector<std::string> linear_limit_warnings(const World& world);

}  // namespace viscera
