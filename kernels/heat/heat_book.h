// Where the energy went that a body was given.
#pragma once

#include "kernels/base/fields.h"

namespace viscera {

/// All [J], since the book was begun. What tissue holds is taken over its resting state.
struct HeatBook {
  double delivered = 0.0;   ///< by current, and by sparks that end on the tissue
  double metabolic = 0.0;   ///< by tissue that is warmer than at rest
  double stored = 0.0;      ///< in warm tissue now, beyond what was there at the start
  double latent = 0.0;      ///< of water that boiled or evaporated
  double vapour = 0.0;      ///< warmth that vapour and fumes took along
  double pyrolysis = 0.0;   ///< taken by solids that turned to char and fumes
  double perfused = 0.0;    ///< carried away by blood
  double gas = 0.0;         ///< to the gas at the surface
  double instrument = 0.0;  ///< to instruments that touch
  double boundary = 0.0;    ///< into tissue too cold to be followed
  double removed = 0.0;     ///< with tissue that was taken away

  double given() const { return delivered + metabolic; }
  double taken() const {
    return stored + latent + vapour + pyrolysis + perfused + gas + instrument + boundary + removed;
  }
  /// What the book doesn't explain: rounding of temperatures.
  double residual() const { return given() - taken(); }

  static constexpr auto fields() {
    using H = HeatBook;
    return std::tuple(field("delivered", &H::delivered), field("metabolic", &H::metabolic),
                      field("stored", &H::stored), field("latent", &H::latent),
                      field("vapour", &H::vapour), field("pyrolysis", &H::pyrolysis),
                      field("perfused", &H::perfused), field("gas", &H::gas),
                      field("instrument", &H::instrument), field("boundary", &H::boundary),
                      field("removed", &H::removed));
  }
};
static_assert(fields_cover<HeatBook>());

}  // namespace viscera
