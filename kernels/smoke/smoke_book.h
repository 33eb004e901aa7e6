// Where the smoke of a volume is: emitted = airborne + background + evacuated + leaked + deposited.
#pragma once

#include "kernels/base/fields.h"

namespace viscera {

/// Masses [kg]. Smoke that no particle carries any more, old, crowded out or beyond an open side,
/// is mixed evenly into the cavity's gas: the background, which outflow thins exponentially. The
/// airborne part is the particles' own (SmokeVolume::airborne).
struct SmokeBook {
  double emitted = 0.0;
  double background = 0.0;
  double evacuated = 0.0;
  double leaked = 0.0;
  double deposited = 0.0;

  /// Outflow of well-mixed gas for dt [s] from a cavity of `volume` [m3], flows in [m3/s]:
  /// B' = -B (evacuation + leak) / volume.
  void flow_out(double volume, double evacuation, double leak, double dt);
  /// What is left for the particles if the book closes.
  double owed_airborne() const { return emitted - background - evacuated - leaked - deposited; }

  static constexpr auto fields() {
    using B = SmokeBook;
    return std::tuple(field("emitted", &B::emitted), field("background", &B::background),
                      field("evacuated", &B::evacuated), field("leaked", &B::leaked),
                      field("deposited", &B::deposited));
  }
};
static_assert(fields_cover<SmokeBook>());

}  // namespace viscera
