// A knife that runs between the closed jaws of a sealer, in the plane of the shaft and of the way
// the jaws close, and parts what is between them.
//
// The jaws go on pressing and holding: the instrument isn't a blade that goes through what it
// touches (cuts() is false for it). The knife's edge stands from jaw to jaw. Another handle runs it
// than the one that the shaft hangs on, so what tissue withstands is felt there and not at the tip.
#pragma once

#include <vector>

#include "engine/features/parting/parting_keys.h"
#include "engine/simulation/world.h"

namespace viscera {

/// Of an instrument that has one.
struct JawKnife {
  static constexpr std::string_view kName = "jaw knives";
  double travel = 0.0;  ///< 0 back ... 1 at the tip
  double before = 0.0;  ///< as the step began
  static constexpr auto fields() {
    return std::tuple(field("travel", &JawKnife::travel), field("before", &JawKnife::before));
  }
};
static_assert(fields_cover<JawKnife>());

/// So far behind the tip it begins [m]; 0: there is none.
double knife_way_of(const InstrumentDescription& instrument);
/// True where the path pulls its trigger at some time.
bool path_runs_knife(const InstrumentDescription& instrument);
/// The longest that its edge may be, and how thick it is.
BladeDescription knife_of(const InstrumentDescription& instrument);

/// Forward while its trigger is pulled and the jaws are closed, else back.
void run_knives(World& world, double dt);

/// Where its edge passes as jaws stand there, whether they are closed or not; organ frame [m].
std::vector<Vec3> knife_way(const InstrumentDescription& tool, const InstrumentState& state,
                            const Pose& organ);
/// The places along its edge at this travel, always as many, from a little beyond the lower grip
/// surface to as much beyond the upper; organ frame [m].
std::vector<Vec3> knife_edge(const World& world, Entity instrument, Entity organ, double travel);

}  // namespace viscera
