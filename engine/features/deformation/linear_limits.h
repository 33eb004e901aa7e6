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

/// The greatest of one measure since the start.
struct GreatestStrain {
  double value = 0.0;
  double time = 0.0;          ///< [s]
  Vec3 place = Vec3::Zero();  ///< at rest, organ's frame [m]
  bool under_tool = false;    ///< a tool presses or holds within a node's spacing of it
  static constexpr auto fields() {
    using S = GreatestStrain;
    return std::tuple(field("value", &S::value), field("time", &S::time), field("place", &S::place),
                      field("under_tool", &S::under_tool));
  }
};
static_assert(fields_cover<GreatestStrain>());

/// Of one organ. Shapes whose displacements are too small for half of the limits aren't measured.
struct GreatestStrains {
  static constexpr std::string_view kName = "greatest strains";
  GreatestStrain rotation;  ///< [rad]
  GreatestStrain stretch;   ///< share of length
  static constexpr auto fields() {
    using S = GreatestStrains;
    return std::tuple(field("rotation", &S::rotation), field("stretch", &S::stretch));
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
/// OrganState, OrganContact -> GreatestStrains at `time` [s]; whether some organ is beyond the
/// limits now.
bool measure_strains(World& world, double time);
/// To be called when the state is another one: what was measured isn't of it.
void forget_strains(World& world);
/// A sentence for each organ that was beyond.
std::vector<std::string> linear_limit_warnings(const World& world);

}  // namespace viscera
